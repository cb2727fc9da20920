// The table of an FMU's variables: the one place where they are written down. The descriptions, the GUID and whatever
// gets or sets a value go by it. A value reference is the variable's position in the table.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "learnt_step.hpp"
#include "model.hpp"

namespace fmi {

enum class Type { real, integer, boolean };
using TypeNames = std::array<const char*, 3>;
inline constexpr TypeNames type_names{"Real", "Integer", "Boolean"};
enum class Causality { parameter, input, output, local };

/// An input that an output follows without a step.
struct Dependency {
  std::string input;
  int order = 0;  ///< of the input's derivative that it is, where that is a variable
};

/// Values of every type are held as double, which represents all of them exactly.
struct Variable {
  std::string name;
  Causality causality = Causality::output;
  Type type = Type::real;
  std::string unit;  ///< one of those in fmus/description.py, empty if dimensionless
  std::string description;
  std::string choice;  ///< name of its type, see Table::choices
  double start = 0.0;  ///< of parameters, inputs and exact outputs
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  double nominal = 1.0;
  bool exact = false;        ///< an output whose start is the initial state (initial="exact")
  bool discrete = false;     ///< an output that changes at steps only. It is a Real: some tools read all outputs so
  bool on_demand = false;    ///< an output that costs too much to be computed where it is not read
  bool consumed = false;     ///< an input that acts once: read back as 0 after the step that used it
  bool held = false;         ///< an input whose derivatives do nothing: no variables of FMI 3.0
  std::size_t elements = 1;  ///< of the array that begins here, where variables can be arrays; 0: within one

  std::function<void(Model&, const Polynomial&)> set;  ///< parameters, inputs, exact outputs
  std::function<double(const Model&)> get;             ///< outputs
  std::function<double(const Model&)> derivative;      ///< outputs that know their time derivative
  std::vector<Dependency> dependencies;                ///< of an output between steps
  /// Of an output at initialization. Where it has no list, it may depend on all that is set but impulses.
  std::optional<std::vector<std::string>> initial_dependencies{std::in_place};

  /// Whether it is an input that is a polynomial over the step.
  bool continuous_input() const { return causality == Causality::input && !consumed; }

  // Named arguments.
  Variable& range(double low, double high) { return min = low, max = high, *this; }
  Variable& at_least(double low) { return min = low, *this; }
  Variable& positive() { return min = std::numeric_limits<double>::min(), *this; }
  Variable& only_read() { return on_demand = true, *this; }
  Variable& steps_only() { return discrete = true, *this; }
  Variable& value_only() { return held = true, *this; }
  Variable& typical(double value) { return nominal = value, *this; }
  Variable& from(std::vector<std::string> names) { return initial_dependencies = std::move(names), *this; }
  Variable& from_all() { return initial_dependencies.reset(), *this; }
  Variable& follows(const std::vector<std::string>& inputs, int order = 0) {
    for (const std::string& input : inputs) dependencies.push_back({input, order});
    return *this;
  }
};

/// Named alternatives, numbered from 1. Described as an Integer type and not as an Enumeration: libcosim leaves such
/// variables out, Maestro refuses the whole FMU.
struct Choice {
  std::string name, description;
  std::vector<std::string> items;
};

struct LogCategory {
  const char *name, *description;
};
inline constexpr LogCategory log_categories[] = {
    {"logStatusError", "errors; always reported"},
    {"logStatusDiscard", "steps that could not be completed; always reported"},
    {"logStatusWarning", "warnings; always reported"},
    {"logEvents", "calls that change what the instance is doing"},
    {"logAll", "everything"},
};

inline constexpr int max_input_derivative_order = 2, max_output_derivative_order = 1;

struct Table {
  std::string identifier;  ///< modelIdentifier
  std::string title, description;
  double stop_time = 1.0, step_size = default_step, tolerance = 1e-6;  ///< DefaultExperiment
  bool ends_steps_early = false;                                       ///< at events, where it may
  std::vector<Choice> choices;
  std::vector<Variable> variables;
};

/// Each FMU defines these two (fmus/beam/beam_fmu.cpp, fmus/spring/spring_fmu.cpp).
Table make_table();
std::unique_ptr<Model> make_model();

const Table& table();  ///< made once

/// A hash of everything the table says: two FMUs with the same GUID have the same variables.
const std::string& guid();

/// The table as JSON: fmus/description.py makes the descriptions of all versions of FMI from it.
std::string printed_table();

/// Adds variables bound to a concrete model `M`, whose parameters are the struct `parameters`. What reads an output is
/// a function of the model or of its numerics, M::body().
template <class M>
class TableBuilder {
  using Parameters = decltype(M::parameters);

 public:
  explicit TableBuilder(Table& table) : table_(table) {}

  /// A parameter, whose default is the start value. The field is a pointer to a member or a function that returns a
  /// reference.
  template <class Field>
  Variable& parameter(const std::string& name, const std::string& unit, Field field, const std::string& description) {
    using T = std::decay_t<std::invoke_result_t<Field, Parameters&>>;
    Variable& v = add(name, unit, description, Causality::parameter);
    v.type = std::is_same_v<T, bool>                      ? Type::boolean
             : std::is_integral_v<T> || std::is_enum_v<T> ? Type::integer
                                                          : Type::real;
    Parameters defaults;
    v.start = static_cast<double>(std::invoke(field, defaults));
    v.set = [field](Model& m, const Polynomial& value) {
      std::invoke(field, static_cast<M&>(m).parameters) = static_cast<T>(value[0]);
    };
    return v;
  }

  /// An input that is a polynomial over the step, handed to `set(model, polynomial)`.
  template <class Set>
  Variable& input(const std::string& name, const std::string& unit, const std::string& description, Set set) {
    Variable& v = add(name, unit, description, Causality::input);
    v.set = [set](Model& m, const Polynomial& value) { set(static_cast<M&>(m), value); };
    return v;
  }
  Variable& input(const std::string& name, const std::string& unit, const std::string& description,
                  Polynomial M::*field) {
    return input(name, unit, description, [field](M& m, const Polynomial& value) { m.*field = value; });
  }

  /// An input that acts at the start of the next step and is then 0 again.
  Variable& impulse(const std::string& name, const std::string& unit, const std::string& description,
                    double M::*field) {
    Variable& v = input(name, unit, description, [field](M& m, const Polynomial& value) { m.*field = value[0]; });
    v.consumed = true;
    return v;
  }

  /// A result at the communication points, with its time derivative under the inputs that are set: none if it changes
  /// with the steps only.
  template <class Get, class Derivative = double (*)(const M&)>
  Variable& output(
      const std::string& name, const std::string& unit, const std::string& description, Get get,
      Derivative derivative = [](const M&) { return 0.0; }) {
    Variable& v = local(name, unit, description, get);
    v.causality = Causality::output;
    v.derivative = reading(derivative);
    return v;
  }

  /// What can be read as an output, but is none: tools record and plot every output.
  template <class Get>
  Variable& local(const std::string& name, const std::string& unit, const std::string& description, Get get) {
    Variable& v = add(name, unit, description, Causality::local);
    v.get = reading(get);
    return v;
  }

  /// Makes the last output's start value settable: it is a field of the parameters.
  template <class Base>
  void exact_start(double Base::*field) {
    Variable& v = table_.variables.back();
    v.exact = true;
    v.start = Parameters{}.*field;
    v.set = [field](Model& m, const Polynomial& value) { static_cast<M&>(m).parameters.*field = value[0]; };
  }

 private:
  template <class Get>
  static std::function<double(const Model&)> reading(Get get) {
    return [get](const Model& model) {
      const M& m = static_cast<const M&>(model);
      if constexpr (std::is_invocable_v<Get, const M&>)
        return static_cast<double>(std::invoke(get, m));
      else
        return static_cast<double>(std::invoke(get, m.body()));
    };
  }

  Variable& add(const std::string& name, const std::string& unit, const std::string& description, Causality causality) {
    Variable& v = table_.variables.emplace_back();
    v.name = name;
    v.unit = unit;
    v.description = description;
    v.causality = causality;
    return v;
  }

  Table& table_;
};

}  // namespace fmi
