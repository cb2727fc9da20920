// modelDescription.xml of each version of FMI, from the table.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "table.hpp"
#include "text.hpp"

namespace fmi {

/// `source_files`: names in sources/, empty if the FMU carries none.
void describe2(std::ostream& out, const std::vector<std::string>& source_files);
void describe3(std::ostream& out);
/// FMI 3.0: sources/buildDescription.xml.
void describe_build3(std::ostream& out, const std::vector<std::string>& source_files);

// What they have in common; text of attributes begins with a space.

struct Unit {
  const char* name;
  const char* quantity;  ///< also the name of its type
  int kg, m, s, rad;
};
const Unit& unit(const std::string& name);  ///< @throws std::logic_error

std::string attribute(const char* name, const std::string& value);
std::string value_text(const Variable& v, double value);
std::string about(const Table& t);  ///< what an FMU says of itself
/// Writes a type by the attributes that name it and those of its values.
using WriteType = std::function<void(Type, const std::string&, const std::string&)>;
/// Units, types, log categories and the default experiment.
void write_definitions(std::ostream& out, const Table& t, const WriteType& write_type);
std::string role(const Variable& v);   ///< description, causality, variability, initial
std::string range(const Variable& v);  ///< type, unit, bounds, start

}  // namespace fmi
