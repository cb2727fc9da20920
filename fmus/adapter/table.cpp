#include "table.hpp"

#include <cstdio>
#include <initializer_list>
#include <stdexcept>

#include "version.hpp"

namespace fmi {
namespace {

// The table as JSON. Numbers are text: they are written as they are, infinite ones too.

std::string quoted(const std::string& text) { return '"' + text + '"'; }
std::string quoted(double value) { return quoted(number(value)); }
std::string yes(bool value) { return value ? "true" : "false"; }

template <class Items, class Write>
std::string array(const Items& items, const Write& write) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : ",") + write(item);
  return "[" + text + "]";
}

std::string object(std::initializer_list<std::pair<const char*, std::string>> fields) {
  std::string text;
  for (const auto& [name, value] : fields) text += (text.empty() ? "" : ",") + quoted(name) + ":" + value;
  return "{" + text + "}\n";
}

std::string names(const std::vector<std::string>& list) {
  return array(list, [](const std::string& name) { return quoted(name); });
}

std::string variable(const Variable& v) {
  constexpr const char* causalities[] = {"parameter", "input", "output", "local"};
  const auto dependency = [](const Dependency& d) {
    return "[" + quoted(d.input) + "," + std::to_string(d.order) + "]";
  };
  return object({{"name", quoted(v.name)},
                 {"causality", quoted(causalities[static_cast<int>(v.causality)])},
                 {"type", quoted(type_names.at(static_cast<std::size_t>(v.type)))},
                 {"unit", quoted(v.unit)},
                 {"description", quoted(v.description)},
                 {"choice", quoted(v.choice)},
                 {"start", quoted(v.start)},
                 {"min", quoted(v.min)},
                 {"max", quoted(v.max)},
                 {"nominal", quoted(v.nominal)},
                 {"exact", yes(v.exact)},
                 {"consumed", yes(v.consumed)},
                 {"held", yes(v.held)},
                 {"discrete", yes(v.discrete)},
                 {"elements", std::to_string(v.elements)},
                 {"dependencies", array(v.dependencies, dependency)},
                 {"initial_dependencies", v.initial_dependencies ? names(*v.initial_dependencies) : "null"}});
}

std::string choice(const Choice& c) {
  return object({{"name", quoted(c.name)}, {"description", quoted(c.description)}, {"items", names(c.items)}});
}

std::string printed(const Table& t, const std::string& guid) {
  const auto category = [](const LogCategory& c) {
    return object({{"name", quoted(c.name)}, {"description", quoted(c.description)}});
  };
  return object({{"identifier", quoted(t.identifier)},
                 {"title", quoted(t.title)},
                 {"description", quoted(t.description)},
                 {"version", quoted(SPRINGBEAM_VERSION)},
                 {"guid", quoted(guid)},
                 {"stop_time", quoted(t.stop_time)},
                 {"step_size", quoted(t.step_size)},
                 {"tolerance", quoted(t.tolerance)},
                 {"ends_steps_early", yes(t.ends_steps_early)},
                 {"log_categories", array(log_categories, category)},
                 {"choices", array(t.choices, choice)},
                 {"variables", array(t.variables, variable)}});
}

std::string make_guid(const std::string& content) {
  // Two differently seeded halves make the 128 bits of a GUID.
  const unsigned long long first = common::hash(content), second = common::hash(content, 0x9ae16a3b2f90404fULL);
  char text[39];
  std::snprintf(text, sizeof text, "{%08llx-%04llx-%04llx-%04llx-%012llx}", first >> 32, first >> 16 & 0xffff,
                first & 0xffff, second >> 48, second & 0xffffffffffffULL);
  return text;
}

}  // namespace

const Table& table() {
  static const Table instance = make_table();
  return instance;
}

const std::string& guid() {
  static const std::string made = make_guid(printed(table(), ""));
  return made;
}

std::string printed_table() { return printed(table(), guid()); }

}  // namespace fmi
