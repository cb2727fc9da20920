#include <set>

#include "description.hpp"
#include "references3.hpp"

namespace fmi {
namespace {

constexpr const char* kinds[] = {"Float64", "Int32", "Boolean"};

std::string reference_text(std::size_t index, int order = 0) { return std::to_string(reference3(index, order)); }

void write_variable(std::ostream& out, const Variable& v, std::size_t index) {
  const std::string type = kinds[static_cast<int>(v.type)];
  const bool array = v.elements > 1;
  out << "    <" << type << attribute("name", array ? v.name.substr(0, v.name.find('[')) : v.name)
      << attribute("valueReference", reference_text(index)) << role(v) << range(v);
  if (array)
    out << ">\n      <Dimension" << attribute("start", std::to_string(v.elements)) << "/>\n    </" << type << ">\n";
  else
    out << "/>\n";
}

/// FMI 3.0 has no input derivatives of its own: they are inputs.
void write_derivatives(std::ostream& out, const Variable& v, std::size_t index) {
  for (int order = 1; order <= max_input_derivative_order; ++order)
    out << "    <Float64" << attribute("name", "der(" + v.name + (order > 1 ? "," + std::to_string(order) : "") + ")")
        << attribute("valueReference", reference_text(index, order))
        << attribute("description",
                     "derivative of order " + std::to_string(order) + " over the next step, then 0 again")
        << attribute("causality", "input") << attribute("variability", "continuous") << attribute("start", "0")
        << attribute("derivative", reference_text(index, order - 1)) << "/>\n";
}

void write_unknown(std::ostream& out, const char* kind, std::size_t index, const std::set<unsigned>& dependencies) {
  std::string list;
  for (const unsigned d : dependencies) list += (list.empty() ? "" : " ") + std::to_string(d);
  out << "    <" << kind << attribute("valueReference", reference_text(index)) << attribute("dependencies", list)
      << "/>\n";
}

}  // namespace

void describe3(std::ostream& out) {
  const Table& t = table();
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" << attribute("fmiVersion", "3.0")
      << attribute("modelName", t.title) << attribute("instantiationToken", guid()) << about(t) << ">\n"
      << "  <CoSimulation" << attribute("modelIdentifier", t.identifier) << attribute("canGetAndSetFMUState", "true")
      << attribute("canSerializeFMUState", "true") << attribute("providesDirectionalDerivatives", "true")
      << attribute("canHandleVariableCommunicationStepSize", "true")
      << attribute("maxOutputDerivativeOrder", std::to_string(max_output_derivative_order))
      << attribute("mightReturnEarlyFromDoStep", t.ends_steps_early ? "true" : "false")
      << attribute("hasEventMode", "true") << "/>\n";
  write_definitions(out, t, [&out](Type type, const std::string& name, const std::string& values) {
    out << "    <" << kinds[static_cast<int>(type)] << "Type" << name << values << "/>\n";
  });
  out << "  <ModelVariables>\n    <Float64" << attribute("name", "time")
      << attribute("valueReference", reference_text(time_index())) << attribute("description", "time")
      << attribute("causality", "independent") << attribute("variability", "continuous")
      << attribute("declaredType", "Time") << attribute("unit", "s") << "/>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i)
    if (t.variables[i].elements > 0) write_variable(out, t.variables[i], i);
  for (std::size_t i = 0; i < t.variables.size(); ++i)
    if (t.variables[i].continuous_input()) write_derivatives(out, t.variables[i], i);
  out << "  </ModelVariables>\n  <ModelStructure>\n";
  for (const bool initial : {false, true})
    for (std::size_t i = 0; i < t.variables.size(); ++i) {
      const Variable& v = t.variables[i];
      if (v.causality != Causality::output || (initial && v.exact)) continue;
      std::set<unsigned> on;
      if (initial)
        for (const std::string& name : v.initial_dependencies) on.insert(reference3(t.index(name)));
      else
        for (const Dependency& d : v.dependencies) on.insert(reference3(t.index(d.input), d.order));
      write_unknown(out, initial ? "InitialUnknown" : "Output", i, on);
    }
  out << "  </ModelStructure>\n</fmiModelDescription>\n";
}

void describe_build3(std::ostream& out, const std::vector<std::string>& source_files) {
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription" << attribute("fmiVersion", "3.0")
      << ">\n  <BuildConfiguration" << attribute("modelIdentifier", table().identifier) << ">\n";
  // Strictly C files want a set of their own; FMPy compiles the first one alone.
  out << "    <SourceFileSet" << attribute("language", "C++17") << ">\n";
  for (const std::string& name : source_files) out << "      <SourceFile" << attribute("name", name) << "/>\n";
  out << "    </SourceFileSet>\n";
  out << "  </BuildConfiguration>\n</fmiBuildDescription>\n";
}

}  // namespace fmi
