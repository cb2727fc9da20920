// Random calls of one FMU's C functions, legal and illegal, held against a model of what FMI 2.0.4 (section 4.2.4)
// and the FMU promise. Built with the FMU's own sources under sanitizers, see CMakeLists.txt.
//
//   fuzz_NAME calls SEED COUNT [EPISODE]   at least COUNT calls in episodes, each reproducible by its number
//   fuzz_NAME threads SEED                 8 threads with an instance each, bit for bit as one after the other
//
// A broken promise, a report of a sanitizer or a call that takes longer than most_seconds of processor time ends the
// program with the seed, the episode and the last calls. Promises:
//   * a call that is not allowed, or has arguments that are not, returns fmi2Error, or fmi2Discard where a value is out
//     of its range or not known yet; other calls do not;
//   * every fmi2Error, fmi2Discard and fmi2Warning comes with a message that names the function, fmi2OK with none
//     but a warning of fmi2DoStep;
//   * a value that fmi2GetReal delivers is finite; after fmi2DoStep returned fmi2OK every output can be had;
//   * a discarded step leaves every output, and the time, as they were, and the instance goes on;
//   * restoring a state restores every output to the last bit, and the same step from it gives the same bits, also in
//     another instance that got the state as bytes; bytes that are not a state of this FMU are refused.
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <csignal>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "fmi2Functions.h"
#include "table.hpp"

namespace {

constexpr int most_seconds = 60;  // of one call
constexpr std::size_t trace_length = 60;

using Reference = fmi2ValueReference;
using Bits = std::vector<std::uint64_t>;

using fmi::guid;
const std::vector<fmi::Variable>& variables() { return fmi::table().variables; }

// -- what happened -------------------------------------------------------------------------------------------------

struct Trace {
  std::string lines[trace_length];
  std::size_t next = 0;
  unsigned long seed = 0, episode = 0, calls = 0;

  double slowest = 0.0;  ///< of all calls [s of processor time]
  std::string slowest_function = "none";

  void note_time(const char* function, double seconds) {
    if (seconds > slowest) slowest = seconds, slowest_function = function;
  }
  void add(std::string line) { lines[next++ % trace_length] = std::move(line); }
  void print() const {
    for (std::size_t i = next > trace_length ? next - trace_length : 0; i < next; ++i)
      std::fprintf(stderr, "  %s\n", lines[i % trace_length].c_str());
    std::fprintf(stderr, "seed %lu, episode %lu, call %lu\n", seed, episode, calls);
  }
};
Trace trace;

std::string format(const char* pattern, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

[[noreturn]] void fail(const std::string& why) {
  std::fprintf(stderr, "BROKEN: %s\n", why.c_str());
  std::abort();
}

void promise(bool kept, const std::string& why) {
  if (!kept) fail(why);
}

// -- random arguments ----------------------------------------------------------------------------------------------

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  std::uint64_t bits() { return engine_(); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  bool chance(double p) { return unit() < p; }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  /// Log-uniform magnitude, random sign.
  double spread(double low, double high) { return (chance(0.5) ? 1.0 : -1.0) * std::pow(10.0, between(low, high)); }
  template <class T>
  const T& pick(const std::vector<T>& items) {
    return items[below(items.size())];
  }

  /// Anything a double can be.
  double anything() {
    using L = std::numeric_limits<double>;
    static const std::vector<double> special{0.0,
                                             -0.0,
                                             1.0,
                                             -1.0,
                                             L::quiet_NaN(),
                                             -L::quiet_NaN(),
                                             L::infinity(),
                                             -L::infinity(),
                                             L::max(),
                                             L::lowest(),
                                             L::min(),
                                             -L::min(),
                                             L::denorm_min(),
                                             -L::denorm_min(),
                                             L::epsilon(),
                                             1e300,
                                             -1e300,
                                             1e154,
                                             -1e154,
                                             1e-154,
                                             1e77,
                                             -1e77,
                                             1e-300,
                                             4503599627370497.5};
    switch (below(4)) {
      case 0:
        return pick(special);
      case 1:
        return spread(-320.0, 308.0);
      case 2: {
        const std::uint64_t any = bits();
        double value;
        std::memcpy(&value, &any, sizeof value);
        return value;
      }
      default:
        return spread(-6.0, 6.0);
    }
  }
  int any_int() {
    static const std::vector<int> special{0, 1, 2, 3, -1, INT_MAX, INT_MIN, 1000000000, 1000001, 255, 1 << 30};
    return chance(0.5) ? pick(special) : static_cast<int>(below(70)) - 3;
  }

 private:
  std::mt19937_64 engine_;
};

// -- one instance and what is known of it --------------------------------------------------------------------------

enum Phase : unsigned { instantiated = 1, initialization = 2, complete = 4, terminated = 8, error = 16 };
constexpr unsigned any_phase = 31, settable = instantiated | initialization | complete;
constexpr unsigned stepped = complete | terminated | error;

const char* name_of(unsigned phase) {
  switch (phase) {
    case instantiated:
      return "instantiated";
    case initialization:
      return "initialization";
    case complete:
      return "step complete";
    case terminated:
      return "terminated";
    default:
      return "error";
  }
}

struct Saved {
  fmi2FMUstate key = nullptr;
  unsigned phase = 0;
  double time = 0.0, stop = 0.0;
  Bits outputs;  ///< empty where they were not known
};
struct Blob {
  std::vector<char> bytes;
  Saved saved;  ///< what they are of
};

/// Statuses as bits.
enum Expected : unsigned { ok = 1, warning = 2, discard = 4, error_status = 8 };

class Instance {
 public:
  fmi2Component c = nullptr;
  unsigned phase = instantiated;
  double time = 0.0, stop = std::numeric_limits<double>::infinity();
  bool logging = false;
  std::vector<Saved> states;
  std::vector<fmi2FMUstate> freed;
  std::vector<std::string> messages;
  fmi2Status said_as = fmi2OK;  ///< of the last message

  Instance() = default;
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance() { free(); }

  void instantiate(Random& random) {
    const fmi2CallbackFunctions callbacks{log, nullptr, nullptr, nullptr, this};
    logging = random.chance(0.1);
    ++trace.calls;
    c = fmi2Instantiate("fuzz", fmi2CoSimulation, guid().c_str(), nullptr, &callbacks, fmi2False,
                        logging ? fmi2True : fmi2False);
    promise(c != nullptr, "fmi2Instantiate refused what is right");
    phase = instantiated;
    time = 0.0;
    stop = std::numeric_limits<double>::infinity();
    messages.clear();
  }

  void free() {
    if (c) {
      trace.add("fmi2FreeInstance");
      ++trace.calls;
      fmi2FreeInstance(c);
    }
    c = nullptr;
    states.clear();
    freed.clear();
  }

  /// Make the call, compare with what is allowed in `legal` phases and expected there; the phase follows.
  template <class Call>
  fmi2Status call(const char* function, unsigned legal, unsigned expected, const std::string& arguments, Call made) {
    const bool allowed = (phase & legal) != 0;
    trace.add(format("%p %s(%s)  [%s]", c, function, arguments.c_str(), name_of(phase)));
    ++trace.calls;
    messages.clear();
    start_clock();
    const std::clock_t began = std::clock();
    const fmi2Status status = made();
    trace.note_time(function, static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
    const std::string said = messages.empty() ? "" : messages.back();
    trace.add(format("    -> %d %s", static_cast<int>(status), said.c_str()));
    const unsigned bit = status == fmi2OK        ? ok
                         : status == fmi2Warning ? warning
                         : status == fmi2Discard ? discard
                         : status == fmi2Error   ? error_status
                                                 : 0U;
    promise(bit != 0, std::string(function) + " returned a status that is never due");
    if (!allowed) promise(bit == error_status, std::string(function) + " is not allowed here, but returned no error");
    if (allowed) promise((bit & expected) != 0, std::string(function) + " returned what was not expected");
    if (status == fmi2OK) {
      const bool warned = said_as == fmi2Warning && std::string(function) == "fmi2DoStep";
      promise(messages.empty() || logging || warned, std::string(function) + " succeeded with a message: " + said);
    } else {
      promise(!said.empty(), std::string(function) + " failed without a message");
      promise(said.rfind(function, 0) == 0, "the message does not name the function: " + said);
    }
    if (status == fmi2Error) phase = error;
    return status;
  }

  static void start_clock() {
    itimerval limit{};
    limit.it_value.tv_sec = most_seconds;
    setitimer(ITIMER_VIRTUAL, &limit, nullptr);
  }

 private:
  static void log(fmi2ComponentEnvironment self, fmi2String, fmi2Status status, fmi2String, fmi2String message, ...) {
    static_cast<Instance*>(self)->messages.emplace_back(message ? message : "");
    static_cast<Instance*>(self)->said_as = status;
  }
};

std::vector<Reference> outputs_of_type(fmi::Type type) {
  std::vector<Reference> found;
  for (std::size_t i = 0; i < variables().size(); ++i)
    if (variables()[i].get && variables()[i].type == type && variables()[i].name != "warnings")  // no part of the state
      found.push_back(static_cast<Reference>(i));
  return found;
}
const std::vector<Reference>& outputs() {
  static const std::vector<Reference> list = outputs_of_type(fmi::Type::real);
  return list;
}

/// Every output by one call. `expected`: whether it must succeed.
fmi2Status read_outputs(Instance& k, Bits& bits, unsigned expected) {
  std::vector<double> values(outputs().size());
  const fmi2Status status = k.call("fmi2GetReal", any_phase, expected, "all outputs",
                                   [&] { return fmi2GetReal(k.c, outputs().data(), values.size(), values.data()); });
  bits.clear();
  if (status != fmi2OK) return status;
  for (std::size_t i = 0; i < values.size(); ++i) {
    promise(std::isfinite(values[i]),
            "fmi2GetReal delivered " + variables()[outputs()[i]].name + format(" = %g", values[i]));
    std::uint64_t b;
    std::memcpy(&b, &values[i], sizeof b);
    bits.push_back(b);
  }
  return status;
}

void compare(const Bits& a, const Bits& b, const std::string& what) {
  promise(a.size() == b.size(), what + ": not all outputs are there");
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    double x, y;
    std::memcpy(&x, &a[i], sizeof x);
    std::memcpy(&y, &b[i], sizeof y);
    fail(what + ": " + variables()[outputs()[i]].name + format(" = %.17g, was %.17g", y, x));
  }
}

// -- the calls -----------------------------------------------------------------------------------------------------

class Episode {
 public:
  explicit Episode(std::uint64_t seed) : random_(seed) {}

  void run() {
    const std::size_t n = 1 + random_.below(3);
    for (std::size_t i = 0; i < n; ++i) {
      instances_.push_back(std::make_unique<Instance>());
      instances_.back()->instantiate(random_);
    }
    violence_ = random_.chance(0.4) ? 0.0 : random_.between(0.0, 0.4);
    const std::size_t actions = 20 + random_.below(180);
    for (std::size_t i = 0; i < actions; ++i) act(*random_.pick(instances_));
    for (auto& k : instances_) k->free();
  }

 private:
  Random random_;
  std::vector<std::unique_ptr<Instance>> instances_;
  std::vector<Blob> blobs_;
  double violence_ = 0.0;  ///< how often an argument is absurd

  bool absurd() { return random_.chance(violence_); }

  void act(Instance& k) {
    if (random_.chance(0.12)) return anything(k);
    switch (k.phase) {
      case instantiated:
        if (random_.chance(0.5)) return set_parameters(k);
        if (random_.chance(0.5)) return setup(k);
        return enter(k);
      case initialization:
        if (random_.chance(0.3)) return set_parameters(k);
        return exit(k);
      case complete: {
        const std::size_t what = random_.below(20);
        if (what < 7) return step(k);
        if (what < 12) return set_inputs(k);
        if (what < 14) return repeat(k);
        if (what < 16) return get_state(k);
        if (what < 18) return set_state(k);
        if (what < 19) return get(k);
        return bytes(k);
      }
      default:
        if (random_.chance(0.5) && !k.states.empty()) return set_state(k);
        if (random_.chance(0.5)) return reset(k);
        return anything(k);
    }
  }

  void anything(Instance& k) {
    using Action = void (Episode::*)(Instance&);
    static const std::vector<Action> actions{&Episode::setup,
                                             &Episode::enter,
                                             &Episode::exit,
                                             &Episode::terminate,
                                             &Episode::reset,
                                             &Episode::get,
                                             &Episode::set,
                                             &Episode::set_inputs,
                                             &Episode::set_parameters,
                                             &Episode::get_state,
                                             &Episode::set_state,
                                             &Episode::free_state,
                                             &Episode::bytes,
                                             &Episode::step,
                                             &Episode::cancel,
                                             &Episode::statuses,
                                             &Episode::debug_logging,
                                             &Episode::directional,
                                             &Episode::null_component,
                                             &Episode::strings,
                                             &Episode::output_derivatives,
                                             &Episode::instantiate_wrongly,
                                             &Episode::again,
                                             &Episode::repeat};
    (this->*random_.pick(actions))(k);
  }

  // -- life cycle

  void setup(Instance& k) {
    const bool bounded = random_.chance(0.2);
    const double tolerance = absurd() ? random_.anything() : std::pow(10.0, random_.between(-12.0, -1.0));
    const double start = absurd() ? random_.anything() : random_.chance(0.6) ? 0.0 : random_.between(-10.0, 10.0);
    const double stop = absurd() ? random_.anything() : start + random_.between(0.0, 5.0);
    const bool right = std::isfinite(start) && (!bounded || stop >= start);
    const bool with_tolerance = random_.chance(0.5);
    const fmi2Status status =
        k.call("fmi2SetupExperiment", instantiated, right ? ok : error_status, format("%g, %g", start, stop),
               [&] { return fmi2SetupExperiment(k.c, with_tolerance, tolerance, start, bounded, stop); });
    if (status != fmi2OK) return;
    k.time = start;
    k.stop = bounded ? stop : std::numeric_limits<double>::infinity();
  }

  /// A mesh whose modes are found in no time, most of the time.
  void coarsen(Instance& k) {
    for (std::size_t r = 0; r < variables().size(); ++r)
      if (variables()[r].name == "n_elements")
        set_one(k, static_cast<Reference>(r), fmi::Type::integer, static_cast<double>(1 + random_.below(6)));
  }

  void enter(Instance& k) {
    if (k.phase == instantiated && random_.chance(0.98)) coarsen(k);
    if (k.call("fmi2EnterInitializationMode", instantiated, ok, "", [&] { return fmi2EnterInitializationMode(k.c); }) ==
        fmi2OK)
      k.phase = initialization;
  }

  void exit(Instance& k) {
    // Parameters that do not go together are found here.
    if (k.call("fmi2ExitInitializationMode", initialization, ok | error_status, "",
               [&] { return fmi2ExitInitializationMode(k.c); }) != fmi2OK)
      return;
    k.phase = complete;
    Bits bits;
    read_outputs(k, bits, ok | error_status);  // inputs may be too large for a finite force
  }

  void terminate(Instance& k) {
    if (k.call("fmi2Terminate", complete, ok, "", [&] { return fmi2Terminate(k.c); }) == fmi2OK) k.phase = terminated;
  }

  void reset(Instance& k) {
    k.call("fmi2Reset", any_phase, ok, "", [&] { return fmi2Reset(k.c); });
    k.phase = instantiated;
    k.time = 0.0;
    k.stop = std::numeric_limits<double>::infinity();
  }

  void again(Instance& k) {
    k.free();
    k.instantiate(random_);
  }

  void instantiate_wrongly(Instance&) {
    const fmi2CallbackFunctions callbacks{nullptr, nullptr, nullptr, nullptr, nullptr};
    const fmi2CallbackFunctions* functions = random_.chance(0.5) ? &callbacks : nullptr;
    fmi2Component c = nullptr;
    trace.add("fmi2Instantiate, wrongly");
    ++trace.calls;
    switch (random_.below(4)) {
      case 0:
        c = fmi2Instantiate(random_.chance(0.5) ? "" : nullptr, fmi2CoSimulation, guid().c_str(), "", functions, 0, 0);
        break;
      case 1:
        c = fmi2Instantiate("x", static_cast<fmi2Type>(fmi2ModelExchange), guid().c_str(), nullptr, functions, 0, 0);
        break;
      case 2:
        c = fmi2Instantiate("x", fmi2CoSimulation, random_.chance(0.5) ? "%s%n{0}" : nullptr, nullptr, functions, 0, 0);
        break;
      default:  // right, but nobody listens
        c = fmi2Instantiate("x", fmi2CoSimulation, guid().c_str(), "file:nonsense", functions, 1, 1);
        promise(c != nullptr, "fmi2Instantiate refused what is right");
        promise(fmi2DoStep(c, 0.0, -1.0, 0) == fmi2Error, "fmi2DoStep before initialization");
        fmi2FreeInstance(c);
        return;
    }
    promise(c == nullptr, "fmi2Instantiate accepted what is wrong");
  }

  // -- values

  Reference any_reference() {
    if (random_.chance(0.1)) return static_cast<Reference>(random_.chance(0.5) ? variables().size() : random_.bits());
    return static_cast<Reference>(random_.below(variables().size()));
  }

  template <class Value, class Function>
  void get_as(Instance& k, const char* function, fmi::Type type, Function call) {
    std::vector<Reference> vr;
    std::vector<Value> values;
    const std::size_t n = random_.below(6);
    bool right = true, calculated = false;
    for (std::size_t i = 0; i < n; ++i) {
      Reference r = any_reference();
      if (!absurd())
        while (r >= variables().size() || variables()[r].type != type) {
          if (type != fmi::Type::real && random_.chance(0.05)) break;
          r = any_reference();
        }
      vr.push_back(r);
      values.push_back(Value{});
      const bool known = r < variables().size() && variables()[r].type == type;
      right = right && known;
      const bool output = known && variables()[r].get != nullptr;
      calculated = calculated || output;
    }
    const bool null = n > 0 && absurd() && random_.chance(0.3);
    unsigned expected = right && !null ? ok : error_status;
    if (right && !null && calculated) {
      // Not built yet: what was set may not go together. An output may have no finite value under the inputs.
      expected |= k.phase == instantiated ? discard : error_status;
    }
    const fmi2Status status = k.call(function, any_phase, expected, format("%zu values", n), [&] {
      return call(k.c, null && random_.chance(0.5) ? nullptr : vr.data(), n, null ? nullptr : values.data());
    });
    if constexpr (std::is_same_v<Value, double>) {
      if (status == fmi2OK)
        for (std::size_t i = 0; i < n; ++i)
          promise(std::isfinite(values[i]), format("fmi2GetReal delivered %g for %u", values[i], vr[i]));
    }
  }

  void get(Instance& k) {
    switch (random_.below(5)) {
      case 0:
        return get_as<fmi2Integer>(k, "fmi2GetInteger", fmi::Type::integer, fmi2GetInteger);
      case 1:
        return get_as<fmi2Boolean>(k, "fmi2GetBoolean", fmi::Type::boolean, fmi2GetBoolean);
      default:
        return get_as<double>(k, "fmi2GetReal", fmi::Type::real, fmi2GetReal);
    }
  }

  unsigned of_setting(const Instance& k, Reference r, fmi::Type type, double value) const {
    if (r >= variables().size()) return error_status;
    const fmi::Variable& v = variables()[r];
    if (v.type != type || (v.get && !v.exact)) return error_status;
    const bool fixed = v.causality == fmi::Causality::parameter || v.exact;
    // What it is already may be set again.
    if (fixed && (k.phase & (instantiated | initialization)) == 0) return error_status | (v.min <= value ? ok : 0U);
    if (!std::isfinite(value)) return error_status;
    return value >= v.min && value <= v.max ? ok : discard;
  }

  /// A value that is likely to make sense for the variable.
  double sensible(const fmi::Variable& v) {
    const auto is = [&](const char* name) { return v.name == name; };
    if (v.type == fmi::Type::boolean) return random_.chance(0.5);
    if (v.type == fmi::Type::integer) {
      if (is("n_elements")) return static_cast<double>(1 + random_.below(random_.chance(0.9) ? 6 : 40));
      if (is("n_modes")) return random_.chance(0.5) ? 0.0 : static_cast<double>(1 + random_.below(6));
      return static_cast<double>(1 + random_.below(2));
    }
    if (is("relative_tolerance") || is("absolute_tolerance")) return std::pow(10.0, random_.between(-14.0, -3.0));
    if (is("restitution")) return random_.chance(0.3) ? 1.0 : random_.unit();
    if (is("compliance_exponent"))
      return random_.chance(0.5) ? 1.0 + 0.5 * static_cast<double>(random_.below(6)) : random_.between(1.0, 4.0);
    if (is("alpha_b") || is("damping")) return random_.chance(0.4) ? 0.0 : std::pow(10.0, random_.between(-6.0, 1.0));
    if (is("stop_position")) return random_.between(-1.0, 0.0);
    if (v.min == 0.0) return std::pow(10.0, random_.between(-2.0, 4.0));
    return random_.chance(0.2) ? 0.0 : random_.spread(-3.0, 1.5);
  }

  void set_one(Instance& k, Reference r, fmi::Type type, double value) {
    const std::string arguments =
        format("%s = %.17g", r < variables().size() ? variables()[r].name.c_str() : "?", value);
    const unsigned expected = of_setting(k, r, type, value);
    if (type == fmi::Type::real) {
      k.call("fmi2SetReal", settable, expected, arguments, [&] { return fmi2SetReal(k.c, &r, 1, &value); });
    } else {
      const int number = static_cast<int>(value);
      if (type == fmi::Type::integer)
        k.call("fmi2SetInteger", settable, expected, arguments, [&] { return fmi2SetInteger(k.c, &r, 1, &number); });
      else
        k.call("fmi2SetBoolean", settable, expected, arguments, [&] { return fmi2SetBoolean(k.c, &r, 1, &number); });
    }
  }

  double absurd_value(const fmi::Variable& v) {
    if (v.type == fmi::Type::real) return random_.anything();
    if (v.type == fmi::Type::boolean) return static_cast<double>(random_.any_int());
    int value = random_.any_int();
    // Large meshes are slow, not dangerous: most_elements in the FMU's tests.
    while (v.name == "n_elements" && value > 70 && value <= 1000000) value = random_.any_int();
    return static_cast<double>(value);
  }

  void set_variable(Instance& k, Reference r) {
    const fmi::Variable& v = variables()[r];
    double value = absurd() ? absurd_value(v) : sensible(v);
    if (v.type == fmi::Type::boolean) {
      const unsigned expected = of_setting(k, r, v.type, value != 0.0 ? 1.0 : 0.0);
      const int number = static_cast<int>(value);
      k.call("fmi2SetBoolean", settable, expected, v.name + format(" = %d", number),
             [&] { return fmi2SetBoolean(k.c, &r, 1, &number); });
      return;
    }
    set_one(k, r, v.type, value);
  }

  void set_parameters(Instance& k) {
    const std::size_t n = 1 + random_.below(12);
    for (std::size_t i = 0; i < n && (k.phase & settable) != 0; ++i) {
      Reference r = static_cast<Reference>(random_.below(variables().size()));
      while (variables()[r].causality != fmi::Causality::parameter && !variables()[r].exact)
        r = static_cast<Reference>(random_.below(variables().size()));
      set_variable(k, r);
    }
  }

  void set_inputs(Instance& k) {
    const std::size_t n = 1 + random_.below(4);
    for (std::size_t i = 0; i < n && (k.phase & settable) != 0; ++i) {
      Reference r = static_cast<Reference>(random_.below(variables().size()));
      while (variables()[r].causality != fmi::Causality::input)
        r = static_cast<Reference>(random_.below(variables().size()));
      if (random_.chance(0.3))
        derive(k, r);
      else
        set_variable(k, r);
    }
  }

  /// Whatever comes: wrong references, types and NULLs included.
  void set(Instance& k) {
    if (random_.chance(0.2)) {
      const Reference r = any_reference();
      const double value = 1.0;
      const std::size_t n = random_.below(3);
      k.call("fmi2SetReal", settable, n == 0 ? ok : error_status, "NULL", [&] {
        return random_.chance(0.5) ? fmi2SetReal(k.c, nullptr, n, &value) : fmi2SetReal(k.c, &r, n, nullptr);
      });
      return;
    }
    const Reference r = any_reference();
    switch (random_.below(3)) {
      case 0:
        return set_one(k, r, fmi::Type::real, random_.anything());
      case 1: {
        if (r < variables().size() && variables()[r].type == fmi::Type::integer) return set_variable(k, r);
        return set_one(k, r, fmi::Type::integer, random_.any_int());
      }
      default:
        return set_one(k, r, fmi::Type::boolean, random_.chance(0.5) ? 1.0 : 0.0);
    }
  }

  void derive(Instance& k, Reference r) {
    const int order = absurd() ? random_.any_int() : 1 + static_cast<int>(random_.below(2));
    const double value = absurd() ? random_.anything() : random_.spread(-2.0, 2.0);
    const bool known = r < variables().size() && variables()[r].continuous_input();
    const bool right = known && order >= 1 && order <= 2 && std::isfinite(value);
    k.call("fmi2SetRealInputDerivatives", settable, right ? ok : error_status, format("%u, %d, %g", r, order, value),
           [&] { return fmi2SetRealInputDerivatives(k.c, &r, 1, &order, &value); });
  }

  void output_derivatives(Instance& k) {
    const Reference r = any_reference();
    const int order = absurd() ? random_.any_int() : 1;
    double value = 0.0;
    const bool real = r < variables().size() && variables()[r].type == fmi::Type::real && order >= 1;
    const bool known = real && variables()[r].derivative && order == 1;
    const unsigned expected = known ? ok | error_status : error_status;  // it may have no finite value
    const fmi2Status status = k.call("fmi2GetRealOutputDerivatives", stepped, expected, format("%u, %d", r, order),
                                     [&] { return fmi2GetRealOutputDerivatives(k.c, &r, 1, &order, &value); });
    if (status == fmi2OK) promise(std::isfinite(value), format("fmi2GetRealOutputDerivatives delivered %g", value));
  }

  void strings(Instance& k) {
    const Reference r = any_reference();
    fmi2String text = "text";
    if (random_.chance(0.5))
      k.call("fmi2GetString", any_phase, error_status, "", [&] { return fmi2GetString(k.c, &r, 1, &text); });
    else
      k.call("fmi2SetString", settable, error_status, "", [&] { return fmi2SetString(k.c, &r, 1, &text); });
  }

  // -- steps

  double any_size() {
    if (absurd()) return random_.anything();
    if (random_.chance(0.002)) return std::pow(10.0, random_.between(-3.0, 6.0));
    return std::pow(10.0, random_.between(-6.0, -0.5));
  }

  unsigned of_step(const Instance& k, double time, double size) const {
    if (!std::isfinite(time) || !std::isfinite(size) || size <= 0.0) return error_status;
    const double rounding = 64.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(time), std::abs(k.time));
    if (std::abs(time - k.time) > 1e-3 * size + rounding) return error_status;
    if (!(time + size <= k.stop + 1e-3 * size + 1e-9 * std::abs(k.stop))) return error_status;
    return ok | discard;
  }

  fmi2Status step(Instance& k, double time, double size) {
    const bool allowed = k.phase == complete;
    const double reached = k.time;
    Bits before, after;
    // An output may have no finite value under inputs just set.
    const bool known = allowed && read_outputs(k, before, ok | error_status) == fmi2OK;
    if (allowed && k.phase != complete) return fmi2Error;
    const unsigned expected = of_step(k, time, size);
    const fmi2Status status = k.call("fmi2DoStep", complete, expected, format("%.17g, %.17g", time, size),
                                     [&] { return fmi2DoStep(k.c, time, size, fmi2True); });
    if (status == fmi2OK) {
      k.time = time + size;
      read_outputs(k, after, ok);
    } else if (status == fmi2Discard) {
      if (read_outputs(k, after, known ? ok : ok | error_status) == fmi2OK && known)
        compare(before, after, "after a discarded step");
      double last = 0.0;
      k.call("fmi2GetRealStatus", stepped, ok, "",
             [&] { return fmi2GetRealStatus(k.c, fmi2LastSuccessfulTime, &last); });
      promise(last == reached, "fmi2LastSuccessfulTime is not the time before the step");
    }
    return status;
  }

  void step(Instance& k) {
    const double size = any_size();
    const double beside = random_.chance(0.1) ? std::pow(10.0, random_.between(-12.0, -2.0)) * size : 0.0;
    step(k, absurd() && random_.chance(0.3) ? random_.anything() : k.time + beside, size);
  }

  /// A step repeated from its state, here and in another instance: bit for bit.
  void repeat(Instance& k) {
    if (k.phase != complete) return;
    Saved mark;
    k.call("fmi2GetFMUstate", any_phase, ok, "mark", [&] { return fmi2GetFMUstate(k.c, &mark.key); });
    const double size = any_size(), start = k.time;
    const std::vector<char> blob = serialized(k, mark.key);
    Bits first, other;
    const fmi2Status status = step(k, start, size);
    if (status == fmi2OK) read_outputs(k, first, ok);
    restore(k, mark.key, complete, start, k.stop);
    promise(step(k, start, size) == status, "the repeated step has another status");
    if (status == fmi2OK) {
      read_outputs(k, other, ok);
      compare(first, other, "the repeated step");
    }
    Instance& twin = *random_.pick(instances_);
    if (&twin != &k) {
      Saved copy;
      twin.call("fmi2DeSerializeFMUstate", any_phase, ok, "twin",
                [&] { return fmi2DeSerializeFMUstate(twin.c, blob.data(), blob.size(), &copy.key); });
      restore(twin, copy.key, complete, start, k.stop);
      promise(step(twin, start, size) == status, "the step in another instance has another status");
      if (status == fmi2OK) {
        read_outputs(twin, other, ok);
        compare(first, other, "the step in another instance");
      }
      twin.call("fmi2FreeFMUstate", any_phase, ok, "twin", [&] { return fmi2FreeFMUstate(twin.c, &copy.key); });
    }
    k.call("fmi2FreeFMUstate", any_phase, ok, "mark", [&] { return fmi2FreeFMUstate(k.c, &mark.key); });
    promise(mark.key == nullptr, "fmi2FreeFMUstate did not clear the state");
  }

  void cancel(Instance& k) {
    k.call("fmi2CancelStep", 0, 0, "", [&] { return fmi2CancelStep(k.c); });
  }

  // -- states

  void restore(Instance& k, fmi2FMUstate key, unsigned phase, double time, double stop) {
    k.call("fmi2SetFMUstate", any_phase, ok, "", [&] { return fmi2SetFMUstate(k.c, key); });
    k.phase = phase;
    k.time = time;
    k.stop = stop;
  }

  void get_state(Instance& k) {
    if (absurd() && random_.chance(0.2)) {
      fmi2FMUstate garbage = reinterpret_cast<fmi2FMUstate>(random_.bits() | 1U);
      fmi2FMUstate* pointer = random_.chance(0.5) ? &garbage : nullptr;
      k.call("fmi2GetFMUstate", any_phase, error_status, "garbage", [&] { return fmi2GetFMUstate(k.c, pointer); });
      return;
    }
    Saved saved;
    const bool over = !k.states.empty() && random_.chance(0.3);
    const std::size_t at = over ? random_.below(k.states.size()) : 0;
    if (over) saved.key = k.states[at].key;
    if (k.phase == complete) read_outputs(k, saved.outputs, ok | error_status);
    saved.phase = k.phase;  // an error, where an output has no finite value
    k.call("fmi2GetFMUstate", any_phase, ok, over ? "over another" : "",
           [&] { return fmi2GetFMUstate(k.c, &saved.key); });
    promise(saved.key != nullptr, "fmi2GetFMUstate delivered no state");
    saved.time = k.time;
    saved.stop = k.stop;
    if (over)
      k.states[at] = saved;
    else
      k.states.push_back(saved);
  }

  fmi2FMUstate foreign(Instance& k) {
    switch (random_.below(4)) {
      case 0:
        return nullptr;
      case 1:
        return reinterpret_cast<fmi2FMUstate>(random_.bits() | 1U);
      case 2:
        if (!k.freed.empty()) {
          fmi2FMUstate old = random_.pick(k.freed);
          for (const Saved& s : k.states)
            if (s.key == old) return nullptr;  // the address is in use again
          return old;
        }
        return nullptr;
      default:
        for (auto& other : instances_)
          if (other.get() != &k && !other->states.empty()) return other->states.front().key;
        return nullptr;
    }
  }

  void set_state(Instance& k) {
    if (k.states.empty() || (absurd() && random_.chance(0.3))) {
      const fmi2FMUstate key = foreign(k);
      k.call("fmi2SetFMUstate", any_phase, error_status, "foreign", [&] { return fmi2SetFMUstate(k.c, key); });
      return;
    }
    const Saved saved = random_.pick(k.states);
    restore(k, saved.key, saved.phase, saved.time, saved.stop);
    if (!saved.outputs.empty()) {
      Bits bits;
      read_outputs(k, bits, ok);
      compare(saved.outputs, bits, "after fmi2SetFMUstate");
    }
  }

  void free_state(Instance& k) {
    if (k.states.empty() || absurd()) {
      fmi2FMUstate key = foreign(k);
      const bool nothing = key == nullptr;
      const bool by_null = random_.chance(0.3);
      k.call("fmi2FreeFMUstate", any_phase, nothing || by_null ? ok : error_status, "foreign",
             [&] { return fmi2FreeFMUstate(k.c, by_null ? nullptr : &key); });
      return;
    }
    const std::size_t at = random_.below(k.states.size());
    fmi2FMUstate key = k.states[at].key;
    k.freed.push_back(key);
    k.states.erase(k.states.begin() + static_cast<std::ptrdiff_t>(at));
    k.call("fmi2FreeFMUstate", any_phase, ok, "", [&] { return fmi2FreeFMUstate(k.c, &key); });
    promise(key == nullptr, "fmi2FreeFMUstate did not clear the state");
  }

  std::vector<char> serialized(Instance& k, fmi2FMUstate key) {
    std::size_t size = 0;
    k.call("fmi2SerializedFMUstateSize", any_phase, ok, "",
           [&] { return fmi2SerializedFMUstateSize(k.c, key, &size); });
    std::vector<char> blob(size);  // exactly: one byte more is a report of the address sanitizer
    k.call("fmi2SerializeFMUstate", any_phase, ok, "",
           [&] { return fmi2SerializeFMUstate(k.c, key, blob.data(), size); });
    return blob;
  }

  void bytes(Instance& k) {
    if (!k.states.empty() && random_.chance(0.4)) {
      const Saved& saved = random_.pick(k.states);
      if (absurd()) {
        char little[32];
        k.call("fmi2SerializeFMUstate", any_phase, error_status, "too little space",
               [&] { return fmi2SerializeFMUstate(k.c, saved.key, little, sizeof little); });
        return;
      }
      // Before initialization FMI 3.0 does not know yet when the run ends.
      if (saved.phase != instantiated) blobs_.push_back({serialized(k, saved.key), saved});
      return;
    }
    if (blobs_.empty() || k.states.size() > 20) return;
    auto [blob, made] = random_.pick(blobs_);
    const std::vector<char> right = blob;
    const std::size_t how = random_.below(4);
    if (how == 1) {  // truncated or longer
      blob.resize(random_.below(blob.size() + 40));
    } else if (how == 2) {  // some bits flipped
      for (std::size_t i = 0; i <= random_.below(4); ++i)
        blob[random_.below(blob.size())] ^= static_cast<char>(1U << random_.below(8));
    } else if (how == 3) {  // nonsense
      for (char& b : blob) b = static_cast<char>(random_.bits());
    }
    const std::vector<char> exact(blob.begin(), blob.end());
    made.key = nullptr;
    const fmi2Status status = k.call("fmi2DeSerializeFMUstate", any_phase, exact == right ? ok : error_status,
                                     format("%zu bytes, way %zu", exact.size(), how), [&, to = &made.key] {
                                       return fmi2DeSerializeFMUstate(k.c, exact.data(), exact.size(), to);
                                     });
    promise((status == fmi2OK) == (made.key != nullptr), "fmi2DeSerializeFMUstate: state and status disagree");
    if (status == fmi2OK) k.states.push_back(made);
  }

  // -- the rest

  void statuses(Instance& k) {
    const auto kind = static_cast<fmi2StatusKind>(random_.below(4));
    switch (random_.below(5)) {
      case 0: {
        fmi2Status value = fmi2OK;
        fmi2Status* to = absurd() ? nullptr : &value;
        k.call("fmi2GetStatus", stepped, to ? discard : error_status, "", [&] { return fmi2GetStatus(k.c, kind, to); });
        return;
      }
      case 1: {
        double value = 0.0;
        k.call("fmi2GetRealStatus", stepped, kind == fmi2LastSuccessfulTime ? ok : discard, "",
               [&] { return fmi2GetRealStatus(k.c, kind, &value); });
        return;
      }
      case 2: {
        int value = 0;
        k.call("fmi2GetIntegerStatus", stepped, discard, "", [&] { return fmi2GetIntegerStatus(k.c, kind, &value); });
        return;
      }
      case 3: {
        int value = 0;
        k.call("fmi2GetBooleanStatus", stepped, kind == fmi2Terminated ? ok : discard, "",
               [&] { return fmi2GetBooleanStatus(k.c, kind, &value); });
        return;
      }
      default: {
        fmi2String value = nullptr;
        k.call("fmi2GetStringStatus", stepped, discard, "", [&] { return fmi2GetStringStatus(k.c, kind, &value); });
        return;
      }
    }
  }

  void debug_logging(Instance& k) {
    static const std::vector<const char*> names{"logAll", "logEvents", "logStatusError", "%n%s", "", "colour"};
    std::vector<fmi2String> chosen;
    bool null = false;
    for (std::size_t i = 0; i < random_.below(4); ++i) chosen.push_back(random_.pick(names));
    if (!chosen.empty() && absurd()) chosen.back() = nullptr, null = true;
    const bool on = random_.chance(0.2);
    const bool before = k.logging;
    k.logging = true;  // with categories that are not there it may say so and succeed
    const unsigned expected = null ? error_status : ok;
    const fmi2Status status = k.call("fmi2SetDebugLogging", any_phase, expected, "",
                                     [&] { return fmi2SetDebugLogging(k.c, on, chosen.size(), chosen.data()); });
    k.logging = status == fmi2Error ? before : on;
  }

  void directional(Instance& k) {
    const Reference of = any_reference(), by = any_reference();
    const double direction = random_.spread(-2.0, 2.0);
    double value = 0.0;
    const bool right = of < variables().size() && by < variables().size() &&
                       variables()[by].causality == fmi::Causality::input && variables()[of].type == fmi::Type::real &&
                       variables()[of].causality == fmi::Causality::output;
    const bool by_parameter = !right && k.phase == initialization;
    const unsigned expected = right || by_parameter ? ok | error_status : error_status;
    const fmi2Status status =
        k.call("fmi2GetDirectionalDerivative", any_phase & ~instantiated, expected, format("%u, %u", of, by),
               [&] { return fmi2GetDirectionalDerivative(k.c, &of, 1, &by, 1, &direction, &value); });
    if (status == fmi2OK) promise(std::isfinite(value), format("fmi2GetDirectionalDerivative delivered %g", value));
  }

  void null_component(Instance&) {
    trace.add("NULL component");
    double value = 0.0;
    const Reference r = 0;
    fmi2FMUstate state = nullptr;
    ++trace.calls;
    switch (random_.below(7)) {
      case 0:
        return promise(fmi2DoStep(nullptr, 0.0, 1.0, 0) == fmi2Error, "fmi2DoStep");
      case 1:
        return promise(fmi2GetReal(nullptr, &r, 1, &value) == fmi2Error, "fmi2GetReal");
      case 2:
        return promise(fmi2SetReal(nullptr, &r, 1, &value) == fmi2Error, "fmi2SetReal");
      case 3:
        return promise(fmi2GetFMUstate(nullptr, &state) == fmi2Error, "fmi2GetFMUstate");
      case 4:
        return promise(fmi2Reset(nullptr) == fmi2Error, "fmi2Reset");
      case 5:
        return promise(fmi2SetDebugLogging(nullptr, 0, 0, nullptr) == fmi2Error, "fmi2SetDebugLogging");
      default:
        return fmi2FreeInstance(nullptr);
    }
  }
};

// -- threads -------------------------------------------------------------------------------------------------------

/// A run with its own inputs; every output after every step.
std::vector<double> trajectory(unsigned number) {
  Random random(number);
  fmi2Component c = fmi2Instantiate("thread", fmi2CoSimulation, guid().c_str(), nullptr, nullptr, fmi2False, fmi2False);
  std::vector<double> all, values(outputs().size());
  bool fine = c && fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK &&
              fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK;
  double time = 0.0;
  fmi2FMUstate state = nullptr;
  for (int i = 0; fine && i < 300; ++i) {
    for (std::size_t r = 0; r < variables().size(); ++r) {
      if (variables()[r].causality != fmi::Causality::input) continue;
      const Reference reference = static_cast<Reference>(r);
      const double value = random.between(-0.1, 0.1);
      fine = fine && fmi2SetReal(c, &reference, 1, &value) == fmi2OK;
    }
    if (i % 50 == 20) fine = fine && fmi2GetFMUstate(c, &state) == fmi2OK;
    const double size = random.between(1e-4, 1e-2);
    fine = fine && fmi2DoStep(c, time, size, fmi2False) == fmi2OK;
    if (i % 50 == 20) {
      fine = fine && fmi2SetFMUstate(c, state) == fmi2OK && fmi2DoStep(c, time, size, fmi2False) == fmi2OK;
    }
    time += size;
    fine = fine && fmi2GetReal(c, outputs().data(), values.size(), values.data()) == fmi2OK;
    all.insert(all.end(), values.begin(), values.end());
  }
  fmi2FreeInstance(c);
  return fine ? all : std::vector<double>{};
}

int threads(unsigned long seed) {
  constexpr unsigned n = 8;
  std::vector<std::vector<double>> serial(n), parallel(n);
  std::vector<std::thread> running;
  // In parallel first: what is made once, the table of variables, is made while others want it.
  for (unsigned i = 0; i < n; ++i)
    running.emplace_back([&parallel, i, seed] { parallel[i] = trajectory(static_cast<unsigned>(seed) + i); });
  for (auto& thread : running) thread.join();
  for (unsigned i = 0; i < n; ++i) serial[i] = trajectory(static_cast<unsigned>(seed) + i);
  for (unsigned i = 0; i < n; ++i) {
    if (serial[i].empty() || serial[i].size() != parallel[i].size() ||
        std::memcmp(serial[i].data(), parallel[i].data(), serial[i].size() * sizeof(double)) != 0) {
      std::fprintf(stderr, "BROKEN: thread %u differs from the serial run\n", i);
      return 1;
    }
  }
  std::printf("%u threads, %zu numbers each: the same bits\n", n, serial[0].size());
  return 0;
}

void too_long(int) {
  static const char text[] = "BROKEN: a call takes too long\n";
  (void)!write(2, text, sizeof text - 1);
  trace.print();  // not safe in a signal handler in general; here the program ends either way
  std::_Exit(1);
}

}  // namespace

// Hooks of the sanitizers: options, and the last calls after a report.
#pragma GCC visibility push(default)
extern "C" const char* __asan_default_options() { return "abort_on_error=1:detect_stack_use_after_return=1"; }
extern "C" const char* __ubsan_default_options() { return "abort_on_error=1:print_stacktrace=1"; }
extern "C" void __ubsan_on_report() { trace.print(); }
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));  // not there without sanitizers
#pragma GCC visibility pop

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "threads" && argc == 3) return threads(std::strtoul(argv[2], nullptr, 10));
  if (mode != "calls" || argc < 4) {
    std::fprintf(stderr, "usage: %s calls SEED COUNT [EPISODE] | threads SEED\n", argv[0]);
    return 2;
  }
  trace.seed = std::strtoul(argv[2], nullptr, 10);
  const unsigned long count = std::strtoul(argv[3], nullptr, 10);
  const bool one = argc > 4;
  trace.episode = one ? std::strtoul(argv[4], nullptr, 10) : 0;
  std::signal(SIGVTALRM, too_long);
  std::signal(SIGABRT, [](int) { trace.print(); });  // a sanitizer ends past this
  if (__sanitizer_set_death_callback) __sanitizer_set_death_callback([] { trace.print(); });
  std::signal(SIGSEGV, [](int) { fail("a call crashed"); });
  do {
    std::seed_seq mix{trace.seed, trace.episode};
    std::uint32_t words[2];
    mix.generate(words, words + 2);
    Episode(std::uint64_t{words[0]} << 32 | words[1]).run();
    ++trace.episode;
  } while (!one && trace.calls < count);
  std::printf("%lu calls in %lu episodes, seed %lu: all promises kept; the slowest call, %s, took %.2g s\n",
              trace.calls, trace.episode, trace.seed, trace.slowest_function.c_str(), trace.slowest);
  return 0;
}
