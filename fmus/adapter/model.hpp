// The interface of a model to the adapter: built from parameters, stepped, saved and restored. No FMI types.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common.hpp"

namespace fmi {

using common::number, common::Polynomial, common::Reached;

/// The call cannot be carried out, and nothing has changed: becomes fmi2Discard or fmi3Discard, after which the
/// instance goes on. So FMI 3.0 has it; an importer that follows FMI 2.0 restores a state before it repeats a step,
/// which does no harm.
class Discarded : public std::runtime_error {
 public:
  /// Whether a step of another size may do. Where none does, the importer is requested to end the simulation: it would
  /// repeat the call again and again. Those that know better change inputs or restore a state.
  enum class Remedy { other_size, none };

  explicit Discarded(const std::string& what, Remedy remedy = Remedy::other_size)
      : std::runtime_error(what), remedy(remedy) {}

  const Remedy remedy;
};

class Model {
 public:
  virtual ~Model() = default;

  /// Called when outputs are first needed, again if parameters changed meanwhile: make the numerics in their
  /// initial state. `tolerance` is the importer's, 0 if it names none; it may tighten, never loosen.
  /// @throws std::exception naming the parameter
  virtual void build(double tolerance) = 0;

  /// What outputs refer to: inputs as set at the start, where they are start values; inputs as set since the last step;
  /// what the last step ended with, as no input has been set since.
  enum class Acting { at_start, as_set, as_stepped };
  /// Called before anything is read, saved or stepped, once for all that has been set, stepped or restored before.
  virtual void evaluate(Acting acting) = 0;

  /// Called for each step, the inputs having been set. Only `to_event` lets it end early, where something happens, and
  /// say so: update() is due then.
  /// @throws Discarded
  virtual Reached step(double time, double size, bool to_event) = 0;

  /// Called in event mode: what happens at this instant, impulses and impacts, happens now and not in the next step.
  virtual void update(double time) = 0;

  /// Called after step(), when inputs have lost their derivatives and impulses: what is set from now on is new.
  virtual void forget_what_was_set() {}

  /// Called for every saved state; the vector is flat and holds everything that build() does not make.
  virtual void save(std::vector<double>& state) const = 0;
  /// A state that a model with these parameters has saved. @throws std::invalid_argument if its length does not fit
  virtual void restore(const std::vector<double>& state) = 0;

  /// Set by step() to what the user should know and is no error; cleared by whoever reports it.
  std::string warning;
  int refused = 0;  ///< steps, counted by whoever asks for them; no part of the state
};

}  // namespace fmi
