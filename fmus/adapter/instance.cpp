#include "instance.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "references3.hpp"
namespace fmi {

namespace {

[[noreturn]] void refuse(const Variable& v, double value, const std::string& why) {
  throw std::invalid_argument("'" + v.name + "' = " + number(value) + why);
}

double finite(const Variable& v, double value, const char* why = " is not finite") {
  if (!std::isfinite(value)) refuse(v, value, why);
  return value;
}

constexpr const char* too_large = " is not finite: the inputs are too large";

/// @throws std::invalid_argument if it is not finite, Discarded if it is out of range
void require_allowed(const Variable& v, double value) {
  finite(v, value);
  if (value >= v.min && value <= v.max) return;
  const bool zero = value <= 0.0 && v.min == std::numeric_limits<double>::min();
  throw Discarded("'" + v.name + "' = " + number(value) +
                  (zero ? " is not > 0" : " is not in [" + number(v.min) + ", " + number(v.max) + "]"));
}

bool is_setting(const Variable& v) { return v.causality == Causality::parameter || v.exact; }

}  // namespace

Instance::Instance(const TypeNames& names) : type_names_(names), table_(table()), place_(table_.variables.size()) {
  for (const bool settings : {true, false}) {
    for (std::size_t i = 0; i < place_.size(); ++i) {
      const Variable& v = table_.variables[i];
      if ((v.get && !v.exact) || is_setting(v) != settings) continue;
      place_[i] = settable_.size();
      settable_.push_back(&v);
    }
    if (settings) n_settings_ = settable_.size();
  }
  reset();
}

void Instance::reset() {
  model_ = make_model();
  progress = {};
  built_ = dirty_ = inputs_set_ = false;
  refused_.reset();
  values_.clear();
  for (const Variable* v : settable_) values_.push_back({v->start, 0.0, 0.0});
}

void Instance::setup(double start, double stop, double tolerance) {
  if (!std::isfinite(start)) throw std::invalid_argument("startTime = " + number(start) + " is not finite");
  if (std::isnan(stop) || stop < start) {
    throw std::invalid_argument("stopTime = " + number(stop) + " is not after startTime = " + number(start));
  }
  progress.time = start;
  progress.stop_time = stop;
  progress.tolerance = tolerance > 0.0 && tolerance < 1.0 ? tolerance : 0.0;
  built_ = false;  // it may be, as outputs can be read before
}

void Instance::ensure_built() {
  if (built_) return;
  for (std::size_t i = 0; i < n_settings_; ++i) settable_[i]->set(*model_, values_[i]);
  model_->build(progress.tolerance);
  model_->evaluate(Model::Acting::as_stepped);
  for (const Variable& v : table_.variables)
    if (v.get && !v.on_demand) finite(v, v.get(*model_), ": the parameters leave the range of floating-point numbers");
  built_ = true;
  for (std::size_t i = n_settings_; i < settable_.size(); ++i) settable_[i]->set(*model_, values_[i]);
  dirty_ = inputs_set_ = true;
}

void Instance::evaluate() {
  ensure_built();
  if (!std::exchange(dirty_, false)) return;
  using Acting = Model::Acting;
  const bool starting = (progress.phase & (instantiated | initialization)) != 0;
  model_->evaluate(starting ? Acting::at_start : inputs_set_ ? Acting::as_set : Acting::as_stepped);
}

void Instance::start() {
  evaluate();
  dirty_ = true;  // inputs are no start values any longer
  inputs_set_ = false;
}

double Instance::evaluated(const Variable& output) {
  evaluate();
  return output.get(*model_);
}

void Instance::changed(std::size_t place) {
  if (place < n_settings_) built_ = false;
  if (!built_) return;
  settable_[place]->set(*model_, values_[place]);
  dirty_ = inputs_set_ = true;
}

const Variable& Instance::variable(unsigned reference, Type type, const char* what) const {
  if (reference >= table_.variables.size()) {
    throw std::invalid_argument("value reference " + std::to_string(reference) + " does not exist: there are " +
                                std::to_string(table_.variables.size()) + " variables, numbered from 0");
  }
  const Variable& v = table_.variables[reference];
  if (type != v.type) {
    const auto name = [this](Type t) { return type_names_.at(static_cast<std::size_t>(t)); };
    throw std::invalid_argument(std::string("cannot ") + what + " '" + v.name + "' (value reference " +
                                std::to_string(reference) + ") as " + name(type) + ": it is " + name(v.type));
  }
  return v;
}

double Instance::get(unsigned reference, Type type) {
  const Variable& v = variable(reference, type, "get");
  if (!v.get || (progress.phase == instantiated && v.exact)) return values_[place_[reference]][0];
  if (progress.phase != instantiated) return finite(v, evaluated(v), too_large);
  try {  // as it would be at the start; what else is to be set may be missing
    return finite(v, evaluated(v), too_large);
  } catch (const std::exception& e) {
    throw Discarded(e.what());
  }
}

const Variable& Instance::continuous_input(unsigned reference, const char* what) const {
  const Variable& v = variable(reference, Type::real, what);
  if (!v.continuous_input()) throw std::invalid_argument("'" + v.name + "' is not an input that takes derivatives");
  return v;
}

void Instance::set(unsigned reference, Type type, double value) {
  const Variable& v = variable(reference, type, "set");
  if (v.get && !v.exact) throw std::invalid_argument("'" + v.name + "' is calculated and cannot be set");
  if (is_setting(v) && (progress.phase & ~(instantiated | initialization)) != 0) {
    if (value == values_[place_[reference]][0]) return;  // importers write all that they know
    throw std::invalid_argument("'" + v.name + "' can only be set before the end of initialization mode");
  }
  require_allowed(v, value);
  values_[place_[reference]][0] = value;
  changed(place_[reference]);
}

void Instance::set_derivative(unsigned reference, int order, double value) {
  const Variable& v = continuous_input(reference, "set a derivative of");
  if (order < 1 || order > max_input_derivative_order) {
    throw std::invalid_argument("derivative order " + std::to_string(order) + " of '" + v.name +
                                "': orders 1 and 2 are possible");
  }
  values_[place_[reference]][static_cast<std::size_t>(order)] = finite(v, value, " is not finite: a derivative of it");
  changed(place_[reference]);
}

double Instance::input_derivative(unsigned reference, int order) const {
  continuous_input(reference, "get a derivative of");
  return values_[place_[reference]].at(static_cast<std::size_t>(order));
}

double Instance::output_derivative(unsigned reference, int order) {
  const Variable& v = variable(reference, Type::real, "get a derivative of");
  if (order < 1) throw std::invalid_argument("derivative order " + std::to_string(order) + ": they begin with 1");
  if (order > max_output_derivative_order || !v.derivative) {
    throw std::invalid_argument("derivative of order " + std::to_string(order) + " of '" + v.name +
                                "' is not available: outputs have that of order 1");
  }
  evaluate();
  return finite(v, v.derivative(*model_), too_large);
}

double Instance::partial_derivative(unsigned unknown, unsigned known) {
  const Variable& of = variable(unknown, Type::real, "differentiate");
  const auto [place, order] = meant_by(known);
  const Variable& by = variable(place, Type::real, "differentiate by");
  if (of.causality != Causality::output) throw std::invalid_argument("'" + of.name + "' is not an output");
  const bool starting = progress.phase == initialization;
  if (by.consumed) return 0.0;  // it acts in the next step
  if (!by.continuous_input() && !(is_setting(by) && starting && order == 0))
    throw std::invalid_argument("'" + by.name + "' is not a continuous input");
  if (of.discrete) return 0.0;
  const auto& at_start = of.initial_dependencies;
  const bool named = !at_start || std::find(at_start->begin(), at_start->end(), by.name) != at_start->end();
  const auto meant = [&, order = order](const Dependency& d) { return d.input == by.name && d.order == order; };
  const bool follows = std::any_of(of.dependencies.begin(), of.dependencies.end(), meant);
  return follows || (starting && order == 0 && named) ? difference(of, place, order) : 0.0;
}

/// A derivative is read rarely: two more evaluations cost little. They leave no trace.
double Instance::difference(const Variable& of, unsigned known, std::size_t order) {
  const Variable& by = table_.variables[known];
  double& value = values_[place_[known]][order];
  const double x = value, change = 1e-6 * (x != 0.0 ? std::abs(x) : by.nominal);
  const std::pair here{x, evaluated(of)};
  const bool inputs_set = inputs_set_;
  std::vector<double> state;
  model_->save(state);
  const auto beside = [&](double there) {
    try {
      if (order == 0) require_allowed(by, there);
      value = there;
      changed(place_[known]);
      return std::pair{there, evaluated(of)};
    } catch (const Discarded&) {
      return here;
    } catch (const std::invalid_argument&) {
      return here;  // that side is out of bounds, its own or those that other parameters set
    }
  };
  const auto [high, above] = beside(x + change);
  const auto [low, below] = beside(x - change);
  value = x;
  changed(place_[known]);
  if (built_) {
    model_->restore(state);
    inputs_set_ = inputs_set;
  }
  return finite(of, (above - below) / (high - low), too_large);
}

Reached Instance::step(double time, double size, bool to_event) {
  if (!std::isfinite(time)) throw std::invalid_argument("currentCommunicationPoint = " + number(time));
  if (!std::isfinite(size) || size <= 0.0) {
    throw std::invalid_argument("communicationStepSize = " + number(size) + ": must be finite and > 0");
  }
  // Importers add up or multiply their times, or count in other units; all that rounds. The step ends where they say,
  // and has their size, but for what is too much of it.
  constexpr double same = 1e-6, beside = 1e-3;
  const double rounding =
      64.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(time), std::abs(progress.time));
  const double late = time - progress.time, end = time + size;
  if (std::abs(late) > beside * size + rounding) {
    throw std::invalid_argument("currentCommunicationPoint = " + number(time) + ", but the slave is at " +
                                number(progress.time));
  }
  if (end > progress.stop_time + beside * size + 1e-9 * std::abs(progress.stop_time)) {
    throw std::invalid_argument("a step from " + number(time) + " to " + number(end) + " goes past the stop time " +
                                number(progress.stop_time));
  }
  if (std::abs(late) > same * size + rounding) {
    time = progress.time;
    size = end - time;
  }
  evaluate();
  Reached reached{};
  try {
    reached = model_->step(time, size, to_event);
  } catch (const Discarded& e) {
    ++model_->refused;
    // The same step under the same inputs ends in the same failure.
    const bool again = refused_ && refused_->time == time && refused_->size == size && refused_->values == values_;
    refused_ = Refused{time, size, values_};
    throw Discarded(e.what(), again ? Discarded::Remedy::none : e.remedy);
  }
  refused_.reset();
  drop_used(true);
  progress.time = reached.size == size ? end : time + reached.size;
  return reached;
}

void Instance::update() {
  evaluate();
  model_->update(progress.time);
  drop_used(false);
}

/// Impulses have acted; after a step derivatives have, too.
void Instance::drop_used(bool stepped) {
  for (std::size_t i = n_settings_; i < settable_.size(); ++i) {
    const bool consumed = settable_[i]->consumed;
    const Polynomial past = values_[i];
    const bool sloped = stepped && (past[1] != 0.0 || past[2] != 0.0);
    if (!(consumed && past[0] != 0.0) && !sloped) continue;
    values_[i] = {consumed ? 0.0 : past[0], 0.0, 0.0};
    settable_[i]->set(*model_, values_[i]);
  }
  if (stepped) model_->forget_what_was_set();
  dirty_ = true;
  inputs_set_ = inputs_set_ && !stepped;
}

void Instance::save(Snapshot& s) {
  if (built_) evaluate();
  s.progress = progress;
  s.values = values_;
  s.numerics.clear();
  if (built_) model_->save(s.numerics);
}

void Instance::check(const Snapshot& s) const {
  const Progress& p = s.progress;
  const unsigned phase = p.phase;
  const bool known = phase != 0 && (phase & (phase - 1)) == 0 && phase <= event_mode;
  const bool in_time = std::isfinite(p.time) && p.stop_time >= p.time && p.tolerance >= 0.0 && p.tolerance < 1.0;
  if (!known || !in_time) throw std::invalid_argument("its phase and time are those of none");
  for (std::size_t i = 0; i < settable_.size(); ++i) {
    const Variable& v = *settable_[i];
    for (const double derivative : s.values[i]) finite(v, derivative);
    require_allowed(v, s.values[i][0]);
    const bool whole = v.type == Type::real || s.values[i][0] == std::trunc(s.values[i][0]);
    if (!whole) refuse(v, s.values[i][0], " is no whole number");
  }
  for (const double value : s.numerics)
    if (!std::isfinite(value)) throw std::invalid_argument("a number of its motion is not finite");
}

void Instance::restore(const Snapshot& s) {
  refused_.reset();
  built_ = built_ && !s.numerics.empty() && progress.tolerance == s.progress.tolerance;
  progress.tolerance = s.progress.tolerance;
  for (std::size_t i = 0; i < settable_.size(); ++i) {
    const void *const now = &values_[i], *const then = &s.values[i];
    if (std::memcmp(now, then, sizeof(Polynomial)) == 0) continue;  // by their bits: −0 too
    values_[i] = s.values[i];
    built_ = built_ && i >= n_settings_;
    if (built_) settable_[i]->set(*model_, values_[i]);
  }
  if (!s.numerics.empty()) {
    ensure_built();
    model_->restore(s.numerics);
    dirty_ = true;
    inputs_set_ = false;
  }
  progress = s.progress;
}

}  // namespace fmi
