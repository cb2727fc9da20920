#include "table.hpp"

#include <cstdio>
#include <stdexcept>

#include "text.hpp"
#include "version.hpp"

namespace fmi {
namespace {

/// What the descriptions are made of, as one text.
std::string everything(const Table& t) {
  std::string text = SPRINGBEAM_VERSION;
  const auto add = [&text](const std::string& part) { text += part + '\n'; };
  for (const std::string& part : {t.identifier, t.title, t.description}) add(part);
  for (const double number : {t.stop_time, t.step_size, t.tolerance}) add(fmi::number(number));
  for (const Choice& c : t.choices) {
    add(c.name + c.description);
    for (const std::string& item : c.items) add(item);
  }
  for (const Variable& v : t.variables) {
    for (const std::string& part : {v.name, v.unit, v.description, v.choice}) add(part);
    for (const double number :
         {v.start, v.min, v.max, v.nominal, static_cast<double>(v.causality), static_cast<double>(v.type),
          v.exact ? 1.0 : 0.0, v.consumed ? 1.0 : 0.0, static_cast<double>(v.elements)})
      add(fmi::number(number));
    for (const Dependency& d : v.dependencies) add(d.input + std::to_string(d.order));
    for (const std::string& name : v.initial_dependencies) add(name);
  }
  return text;
}

std::string make_guid(const std::string& content) {
  // Two differently seeded halves make the 128 bits of a GUID.
  const unsigned long long first = hash(content.data(), content.size()),
                           second = hash(content.data(), content.size(), 0x9ae16a3b2f90404fULL);
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
  static const std::string made = make_guid(everything(table()));
  return made;
}

}  // namespace fmi
