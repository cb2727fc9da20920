#include "description.hpp"

#include <set>

namespace fmi {
namespace {

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
    for (const Dependency& d : t.variables[i].dependencies)
      if (d.order == 0) inputs.push_back(d.input);
    write_unknown(out, t, i, inputs);
  }
  out << "    </Outputs>\n    <InitialUnknowns>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i) {
    const Variable& v = t.variables[i];
    if (v.causality == Causality::output && !v.exact) write_unknown(out, t, i, v.initial_dependencies);
  }
  out << "    </InitialUnknowns>\n  </ModelStructure>\n";
}

}  // namespace

void describe2(std::ostream& out, const std::vector<std::string>& source_files) {
  const Table& t = table();
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" << attribute("fmiVersion", "2.0")
      << attribute("modelName", t.title) << attribute("guid", guid()) << about(t)
      << attribute("numberOfEventIndicators", "0") << ">\n";
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
    for (const std::string& name : source_files) out << "      <File" << attribute("name", name) << "/>\n";
    out << "    </SourceFiles>\n  </CoSimulation>\n";
  }
  write_definitions(out, t, [&out](Type type, const std::string& name, const std::string& values) {
    out << "    <SimpleType" << name << ">\n      <" << type_names[static_cast<int>(type)] << values
        << "/>\n    </SimpleType>\n";
  });
  out << "  <ModelVariables>\n";
  for (std::size_t i = 0; i < t.variables.size(); ++i) {
    const Variable& v = t.variables[i];
    out << "    <!-- index " << i + 1 << " -->\n    <ScalarVariable" << attribute("name", v.name)
        << attribute("valueReference", std::to_string(i)) << role(v) << ">\n      <"
        << type_names[static_cast<int>(v.type)] << range(v) << "/>\n    </ScalarVariable>\n";
  }
  out << "  </ModelVariables>\n";
  write_structure(out, t);
  out << "</fmiModelDescription>\n";
}

}  // namespace fmi
