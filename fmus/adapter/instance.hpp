// One instance of the FMU: parameters, inputs, outputs, steps and states, over a Model and its table. No FMI types.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "snapshot.hpp"
#include "table.hpp"

namespace fmi {

class Instance {
 public:
  explicit Instance(const TypeNames& names);  ///< as messages call types

  Progress progress;

  /// A `tolerance` that is no number between 0 and 1 counts as none.
  void setup(double start, double stop, double tolerance);
  /// Parameters that do not go together are found here.
  void ensure_built();
  /// Called at the end of initialization mode.
  void start();
  void reset();

  // What the importer asks for wrongly throws std::invalid_argument, also an output that the inputs which were set
  // since the last step drive out of the range of numbers.

  double get(unsigned reference, Type type);
  void set(unsigned reference, Type type, double value);
  void set_derivative(unsigned reference, int order, double value);
  double input_derivative(unsigned reference, int order) const;  ///< 0 if it is not set
  double output_derivative(unsigned reference, int order);
  /// ∂unknown/∂known at the present instant, of an output by a continuous input, by a derivative of one
  /// (references3.hpp) or, before the start, by a parameter.
  double partial_derivative(unsigned unknown, unsigned known);

  /// @throws Discarded
  Reached step(double time, double size, bool to_event);
  void update();  ///< see Model::update
  /// What the model has to say after a step; empty if nothing.
  std::string take_warning() { return std::exchange(model_->warning, {}); }

  /// Into a snapshot that may hold an earlier state: its memory is used again.
  void save(Snapshot& snapshot);
  void restore(const Snapshot& snapshot);
  /// @throws std::exception if it holds what no instance of this FMU does
  void check(const Snapshot& snapshot) const;

  std::size_t n_values() const { return values_.size(); }

 private:
  const Variable& variable(unsigned reference, Type type, const char* what) const;
  const Variable& continuous_input(unsigned reference, const char* what) const;
  /// Brings the model up to date with all that was set, stepped or restored.
  void evaluate();
  double evaluated(const Variable& output);
  void drop_used(bool stepped);
  double difference(const Variable& of, unsigned known, std::size_t order);  ///< the derivative by differences
  void changed(std::size_t place);                                           ///< by the importer

  const TypeNames type_names_;
  const Table& table_;
  std::unique_ptr<Model> model_;
  // What the model has of what was called (–: as before). Whoever reads it has it evaluated: built, then up to date
  // with Model::Acting at_start before the end of initialization mode, later as_set or as_stepped, by inputs_set_.
  //                              built_   dirty_   inputs_set_
  //     new, set up, a setting   no       –        –
  //     built                    yes      yes      yes           all inputs are handed to it
  //     an input                 –        yes      yes
  //     start, step, restored    –        yes      no            derivatives are used up
  //     updated at an event      –        yes      –
  //     evaluated                yes      no       –
  bool built_ = false;                     ///< with the present settings
  bool dirty_ = false;                     ///< not evaluated since something was set or done
  bool inputs_set_ = false;                ///< since the last step
  std::vector<const Variable*> settable_;  ///< what is set before the start, then the inputs
  std::size_t n_settings_ = 0;             ///< the former
  std::vector<std::size_t> place_;         ///< of every variable, among these
  std::vector<Polynomial> values_;         ///< of these
  struct Refused {
    double time, size;
    std::vector<Polynomial> values;
  };
  std::optional<Refused> refused_;  ///< the last step, if it was
};

}  // namespace fmi
