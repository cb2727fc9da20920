// What the descriptions of all versions of FMI have in common.
#include "description.hpp"

#include <cmath>
#include <set>
#include <stdexcept>

#include "version.hpp"

namespace fmi {
namespace {

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

std::string escaped(const std::string& s) {
  std::string out;
  for (const char c : s) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return out;
}

std::vector<const Unit*> used_units(const Table& t) {
  std::set<std::string> used;
  for (const Variable& v : t.variables) used.insert(v.unit);
  std::vector<const Unit*> found;
  for (const Unit& u : units)
    if (used.count(u.name)) found.push_back(&u);
  return found;
}

}  // namespace

const Unit& unit(const std::string& name) {
  for (const Unit& u : units) {
    if (name == u.name) return u;
  }
  throw std::logic_error("unit '" + name + "' is not in the list of units");
}

std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + escaped(value) + "\"";
}

std::string value_text(const Variable& v, double value) {
  if (v.type == Type::boolean) return value != 0.0 ? "true" : "false";
  if (v.type == Type::real) return number(value);
  return std::to_string(static_cast<long long>(value));
}

std::string about(const Table& t) {
  return attribute("description", t.description) + attribute("version", SPRINGBEAM_VERSION) +
         attribute("license", "BSD-3-Clause") + attribute("generationTool", "springbeam " SPRINGBEAM_VERSION) +
         attribute("variableNamingConvention", "structured");
}

void write_definitions(std::ostream& out, const Table& t, const WriteType& write_type) {
  const auto used = used_units(t);
  out << "  <UnitDefinitions>\n";
  for (const Unit* u : used) {
    out << "    <Unit" << attribute("name", u->name) << ">\n      <BaseUnit";
    const std::pair<const char*, int> exponents[] = {{"kg", u->kg}, {"m", u->m}, {"s", u->s}, {"rad", u->rad}};
    for (const auto& [name, exponent] : exponents) {
      if (exponent != 0) out << attribute(name, std::to_string(exponent));
    }
    out << "/>\n    </Unit>\n";
  }
  out << "  </UnitDefinitions>\n  <TypeDefinitions>\n";
  for (const Unit* u : used)
    write_type(Type::real, attribute("name", u->quantity),
               attribute("quantity", u->quantity) + attribute("unit", u->name));
  for (const Choice& c : t.choices) {
    std::string text = c.description + ":";
    for (std::size_t i = 0; i < c.items.size(); ++i) {
      text += (i ? "; " : " ") + std::to_string(i + 1) + " = " + c.items[i];
    }
    write_type(Type::integer, attribute("name", c.name) + attribute("description", text),
               attribute("min", "1") + attribute("max", std::to_string(c.items.size())));
  }
  out << "  </TypeDefinitions>\n  <LogCategories>\n";
  for (const auto& [name, text] : log_categories) {
    out << "    <Category" << attribute("name", name) << attribute("description", text) << "/>\n";
  }
  out << "  </LogCategories>\n  <DefaultExperiment startTime=\"0\"" << attribute("stopTime", number(t.stop_time))
      << (t.tolerance > 0.0 ? attribute("tolerance", number(t.tolerance)) : "")
      << attribute("stepSize", number(t.step_size)) << "/>\n";
}

std::string role(const Variable& v) {
  constexpr const char* causalities[] = {"parameter", "input", "output", "local"};
  const bool is_parameter = v.causality == Causality::parameter;
  std::string text = attribute("description", v.description) +
                     attribute("causality", causalities[static_cast<int>(v.causality)]) +
                     attribute("variability", is_parameter                         ? "fixed"
                                              : v.consumed || v.type != Type::real ? "discrete"
                                                                                   : "continuous");
  if (v.causality != Causality::input) text += attribute("initial", is_parameter || v.exact ? "exact" : "calculated");
  return text;
}

std::string range(const Variable& v) {
  std::string text;
  if (!v.unit.empty()) {
    const Unit& u = unit(v.unit);
    text += attribute("declaredType", u.quantity) + attribute("quantity", u.quantity) + attribute("unit", u.name);
  }
  if (!v.choice.empty()) text += attribute("declaredType", v.choice);
  if (v.type != Type::boolean) {
    if (std::isfinite(v.min)) text += attribute("min", value_text(v, v.min));
    if (std::isfinite(v.max)) text += attribute("max", value_text(v, v.max));
  }
  if (v.type == Type::real && v.nominal != 1.0) text += attribute("nominal", number(v.nominal));
  if (!v.get || v.exact) text += attribute("start", value_text(v, v.start));
  return text;
}

}  // namespace fmi
