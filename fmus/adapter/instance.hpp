// One instance of the FMU: the life cycle of FMI 2.0.4, section 4.2.4, over a Model and its table. No FMI types.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "snapshot.hpp"
#include "table.hpp"

namespace fmi {

/// The states of section 4.2.4 that a slave which completes every step at once can be in, as bits.
enum Phase : unsigned {
  instantiated = 1U << 0,
  initialization = 1U << 1,
  step_complete = 1U << 2,
  terminated = 1U << 3,
  error = 1U << 4,
};

class Instance {
 public:
  Instance();

  Phase phase = instantiated;
  int last_status = 0;  ///< of the last step

  void setup(double start, double stop, double tolerance);
  void enter_initialization();
  void exit_initialization();
  void terminate();
  void reset();

  /// @throws Discarded if an output has no finite value under the inputs that were set since the last step
  double get(unsigned reference, Type type);
  void set(unsigned reference, Type type, double value);
  void set_derivative(unsigned reference, int order, double value);
  /// @throws Discarded if it is not known
  double output_derivative(unsigned reference, int order);
  /// ∂unknown/∂known, of an output by a continuous input, at the present instant.
  /// @throws Discarded if it is not known
  double partial_derivative(unsigned unknown, unsigned known);

  /// @throws Discarded, std::invalid_argument
  void step(double time, double size);
  double time() const { return time_; }
  /// What the model has to say after a step; empty if nothing.
  std::string take_warning() { return std::exchange(model_->warning, {}); }

  /// Into a snapshot that may hold an earlier state: its memory is used again.
  void save(Snapshot& snapshot) const;
  /// A foreign snapshot is checked, and then no longer foreign. @throws std::invalid_argument if it is no state
  void restore(Snapshot& snapshot);

  std::size_t n_settings() const { return fixed_.size(); }
  std::size_t n_inputs() const { return inputs_.size(); }

 private:
  const Variable& variable(unsigned reference, Type type, const char* what) const;
  void ensure_built();
  void push_inputs();
  Polynomial& use(std::size_t input);
  void show(const Variable& v, std::size_t input);  ///< to the model, if there is one

  const Table& table_;
  std::unique_ptr<Model> model_;
  std::vector<const Variable*> inputs_, fixed_;          ///< fixed: what is set before the start
  std::vector<std::size_t> place_;                       ///< of every variable, among the inputs or the fixed
  std::shared_ptr<const std::vector<double>> settings_;  ///< of the fixed; saved states share it
  std::vector<Polynomial> values_;                       ///< of the inputs
  std::vector<std::size_t> used_;                        ///< inputs that were ever set: the others cost nothing
  bool built_ = false;
  double time_ = 0.0;
  double stop_time_ = std::numeric_limits<double>::infinity();
  double tolerance_ = 0.0;  ///< relative, asked for by the importer; 0 = none
};

}  // namespace fmi
