#include "description.hpp"

#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>
#include <stdexcept>

#include "../common/text.hpp"
#include "version.hpp"

namespace fmi {

using common::number;

namespace {

struct Unit {
  const char* name;
  const char* quantity;  ///< also the name of the SimpleType
  int kg, m, s, rad;
};

// Every unit used by the tables, with its SI base units.
constexpr Unit units[] = {
    {"kg", "Mass", 1, 0, 0, 0},
    {"kg/m3", "Density", 1, -3, 0, 0},
    {"m", "Length", 0, 1, 0, 0},
    {"m2", "Area", 0, 2, 0, 0},
    {"m4", "SecondMomentOfArea", 0, 4, 0, 0},
    {"m/s", "Velocity", 0, 1, -1, 0},
    {"m/s2", "Acceleration", 0, 1, -2, 0},
    {"m.s", "Absement", 0, 1, 1, 0},
    {"m.s2", "Absity", 0, 1, 2, 0},
    {"s", "Time", 0, 0, 1, 0},
    {"1/s", "Rate", 0, 0, -1, 0},
    {"s/m", "InverseVelocity", 0, -1, 1, 0},
    {"rad", "Angle", 0, 0, 0, 1},
    {"Pa", "Pressure", 1, -1, -2, 0},
    {"N", "Force", 1, 1, -2, 0},
    {"N/m", "Stiffness", 1, 0, -2, 0},
    {"m/N", "Compliance", -1, 0, 2, 0},
    {"N/m3", "CubicStiffness", 1, -2, -2, 0},
    {"N.m", "Torque", 1, 2, -2, 0},
    {"N.s", "Impulse", 1, 1, -1, 0},
    {"N.s/m", "Damping", 1, 0, -1, 0},
    {"J", "Energy", 1, 2, -2, 0},
};

const Unit& unit(const std::string& name) {
  for (const Unit& u : units) {
    if (name == u.name) return u;
  }
  throw std::logic_error("unit '" + name + "' is not in the list of units");
}

std::string escaped(const std::string& s) {
  std::string out;
  for (const char c : s) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return out;
}

std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + escaped(value) + "\"";
}

std::string value_text(const Variable& v, double value) {
  if (v.type == Type::boolean) return value != 0.0 ? "true" : "false";
  if (v.type == Type::real) return number(value);
  return std::to_string(static_cast<long long>(value));
}

void write_units(std::ostream& out, const std::set<std::string>& used) {
  out << "  <UnitDefinitions>\n";
  for (const Unit& u : units) {
    if (!used.count(u.name)) continue;
    out << "    <Unit" << attribute("name", u.name) << ">\n      <BaseUnit";
    const std::pair<const char*, int> exponents[] = {{"kg", u.kg}, {"m", u.m}, {"s", u.s}, {"rad", u.rad}};
    for (const auto& [name, exponent] : exponents) {
      if (exponent != 0) out << attribute(name, std::to_string(exponent));
    }
    out << "/>\n    </Unit>\n";
  }
  out << "  </UnitDefinitions>\n";
}

void write_types(std::ostream& out, const Table& t, const std::set<std::string>& used) {
  out << "  <TypeDefinitions>\n";
  for (const Unit& u : units) {
    if (!used.count(u.name)) continue;
    out << "    <SimpleType" << attribute("name", u.quantity) << ">\n      <Real" << attribute("quantity", u.quantity)
        << attribute("unit", u.name) << "/>\n    </SimpleType>\n";
  }
  for (const Choice& c : t.choices) {
    std::string text = c.description + ":";
    for (std::size_t i = 0; i < c.items.size(); ++i) {
      text += (i ? "; " : " ") + std::to_string(i + 1) + " = " + c.items[i];
    }
    out << "    <SimpleType" << attribute("name", c.name) << attribute("description", text) << ">\n      <Integer"
        << attribute("min", "1") << attribute("max", std::to_string(c.items.size())) << "/>\n    </SimpleType>\n";
  }
  out << "  </TypeDefinitions>\n";
}

void write_variable(std::ostream& out, const Variable& v, std::size_t reference) {
  constexpr const char* causalities[] = {"parameter", "input", "output", "local"};
  const bool is_parameter = v.causality == Causality::parameter;
  out << "    <ScalarVariable" << attribute("name", v.name) << attribute("valueReference", std::to_string(reference))
      << attribute("description", v.description) << attribute("causality", causalities[static_cast<int>(v.causality)])
      << attribute("variability", is_parameter                         ? "fixed"
                                  : v.consumed || v.type != Type::real ? "discrete"
                                                                       : "continuous");
  if (v.causality != Causality::input) out << attribute("initial", is_parameter || v.exact ? "exact" : "calculated");
  out << ">\n      <";
  out << type_names[static_cast<int>(v.type)];
  if (!v.unit.empty()) {
    const Unit& u = unit(v.unit);
    out << attribute("declaredType", u.quantity) << attribute("quantity", u.quantity) << attribute("unit", u.name);
  }
  if (!v.choice.empty()) out << attribute("declaredType", v.choice);
  if (v.type != Type::boolean) {
    if (std::isfinite(v.min)) out << attribute("min", value_text(v, v.min));
    if (std::isfinite(v.max)) out << attribute("max", value_text(v, v.max));
  }
  if (v.type == Type::real && v.nominal != 1.0) out << attribute("nominal", number(v.nominal));
  if (!v.get || v.exact) out << attribute("start", value_text(v, v.start));
  out << "/>\n    </ScalarVariable>\n";
}

void write_unknown(std::ostream& out, const Table& t, std::size_t i, const std::vector<std::string>& names) {
  std::set<std::size_t> dependencies;
  for (const std::string& name : names) dependencies.insert(t.index(name) + 1);
  std::string list;
  for (std::size_t d : dependencies) list += (list.empty() ? "" : " ") + std::to_string(d);
  out << "      <Unknown" << attribute("index", std::to_string(i + 1)) << attribute("dependencies", list) << "/>\n";
}

void write_structure(std::ostream& out, const Table& t) {
  out << "  <ModelStructure>\n    <Outputs>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i) {
    if (t.variables[i].causality != Causality::output) continue;
    std::vector<std::string> inputs;
    for (const Dependency& d : t.variables[i].dependencies) inputs.push_back(d.input);
    write_unknown(out, t, i, inputs);
  }
  out << "    </Outputs>\n    <InitialUnknowns>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i) {
    const Variable& v = t.variables[i];
    if (v.causality == Causality::output && !v.exact) write_unknown(out, t, i, v.initial_dependencies);
  }
  out << "    </InitialUnknowns>\n  </ModelStructure>\n";
}

std::string document(const Table& t, const std::string& identity, const std::string& source_files) {
  std::set<std::string> used;
  for (const Variable& v : t.variables) {
    if (!v.unit.empty()) used.insert(v.unit);
  }
  std::ostringstream out;
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" << attribute("fmiVersion", "2.0")
      << attribute("modelName", t.title) << attribute("guid", identity) << attribute("description", t.description)
      << attribute("version", SPRINGBEAM_VERSION) << attribute("license", "BSD-3-Clause")
      << attribute("generationTool", "springbeam " SPRINGBEAM_VERSION)
      << attribute("variableNamingConvention", "structured") << attribute("numberOfEventIndicators", "0") << ">\n";
  out << "  <CoSimulation" << attribute("modelIdentifier", t.identifier) << attribute("needsExecutionTool", "false")
      << attribute("canHandleVariableCommunicationStepSize", "true") << attribute("canInterpolateInputs", "true")
      << attribute("maxOutputDerivativeOrder", std::to_string(max_output_derivative_order))
      << attribute("canRunAsynchronuously", "false") << attribute("canBeInstantiatedOnlyOncePerProcess", "false")
      << attribute("canNotUseMemoryManagementFunctions", "true") << attribute("canGetAndSetFMUstate", "true")
      << attribute("canSerializeFMUstate", "true") << attribute("providesDirectionalDerivative", "true");
  if (source_files.empty()) {
    out << "/>\n";
  } else {
    out << ">\n    <SourceFiles>\n";
    std::istringstream names(source_files);
    for (std::string name; std::getline(names, name);) out << "      <File" << attribute("name", name) << "/>\n";
    out << "    </SourceFiles>\n  </CoSimulation>\n";
  }
  write_units(out, used);
  write_types(out, t, used);
  out << "  <LogCategories>\n";
  for (const auto& [name, text] : log_categories) {
    out << "    <Category" << attribute("name", name) << attribute("description", text) << "/>\n";
  }
  out << "  </LogCategories>\n  <DefaultExperiment startTime=\"0\"" << attribute("stopTime", number(t.stop_time))
      << (t.tolerance > 0.0 ? attribute("tolerance", number(t.tolerance)) : "")
      << attribute("stepSize", number(t.step_size)) << "/>\n  <ModelVariables>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i) {
    out << "    <!-- index " << i + 1 << " -->\n";
    write_variable(out, t.variables[i], i);
  }
  out << "  </ModelVariables>\n";
  write_structure(out, t);
  out << "</fmiModelDescription>\n";
  return out.str();
}

std::string make_guid(const std::string& content) {
  // Two differently seeded halves make the 128 bits of a GUID.
  const unsigned long long first = common::hash(content.data(), content.size()),
                           second = common::hash(content.data(), content.size(), 0x9ae16a3b2f90404fULL);
  char text[39];
  std::snprintf(text, sizeof text, "{%08llx-%04llx-%04llx-%04llx-%012llx}", first >> 32, first >> 16 & 0xffff,
                first & 0xffff, second >> 48, second & 0xffffffffffffULL);
  return text;
}

}  // namespace

std::size_t Table::index(const std::string& name) const {
  for (std::size_t i = 0; i < variables.size(); ++i) {
    if (variables[i].name == name) return i;
  }
  throw std::logic_error("no variable '" + name + "'");
}

const Table& table() {
  static const Table instance = make_table();
  return instance;
}

const std::string& guid() {
  static const std::string made = make_guid(document(table(), "", ""));
  return made;
}

std::string description(const std::string& source_files) { return document(table(), guid(), source_files); }

}  // namespace fmi
