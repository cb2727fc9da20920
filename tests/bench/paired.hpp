// Two pieces of code timed in turn, so that what disturbs one disturbs the other: their ratio outlasts the machine's
// moods. Results go to the standard output, one JSON object a line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "../../fmus/adapter/instance.hpp"

namespace bench {

struct Options {
  bool quick = false;     ///< only see that it runs
  int rounds = 21;        ///< how often both are timed
  double seconds = 4e-3;  ///< per round and side
};

inline Options options(int argc, char** argv) {
  Options o;
  if (argc > 1 && std::strcmp(argv[1], "--quick") == 0) o = {true, 2, 1e-5};
  return o;
}

/// Processor time [s]: what else runs on the machine takes none of it.
inline double now() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Seconds per call of `calls` calls.
template <class Work>
double timed(const Work& work, std::size_t calls) {
  const double began = now();
  for (std::size_t i = 0; i < calls; ++i) work();
  return (now() - began) / static_cast<double>(calls);
}

/// As many calls as take `seconds`.
template <class Work>
std::size_t calls_for(const Work& work, double seconds) {
  work();
  std::size_t calls = 1;
  while (true) {
    const double taken = timed(work, calls) * static_cast<double>(calls);
    if (taken >= 0.2 * seconds)
      return std::max<std::size_t>(1, static_cast<std::size_t>(seconds / taken * static_cast<double>(calls)));
    calls *= 4;
  }
}

inline void print(const char* key, const std::vector<double>& values) {
  std::printf("\"%s\": [", key);
  for (std::size_t i = 0; i < values.size(); ++i) std::printf("%s%.6g", i > 0 ? ", " : "", values[i]);
  std::printf("]");
}

/// Times `ours` and `rival` in turn and prints the seconds per call of each round.
template <class Ours, class Rival>
void compare(const char* name, const Options& o, const Ours& ours, const Rival& rival) {
  const std::size_t our_calls = calls_for(ours, o.seconds), rival_calls = calls_for(rival, o.seconds);
  std::vector<double> a, b;
  for (int round = 0; round < o.rounds; ++round) {
    a.push_back(timed(ours, our_calls));
    b.push_back(timed(rival, rival_calls));
  }
  std::printf("{\"name\": \"%s\", ", name);
  print("ours", a);
  std::printf(", ");
  print("rival", b);
  std::printf("}\n");
}

using Values = std::vector<std::pair<const char*, double>>;  ///< start values by name

/// An FMU without the library around it, called as an importer written in C would.
class Fmu {
 public:
  explicit Fmu(const Values& values) : instance_(fmi::type_names) {
    for (const auto& [name, value] : values) set(reference(name), value);
    instance_.ensure_built();
    instance_.progress.phase = fmi::initialization;
    instance_.start();
    instance_.progress.phase = fmi::step_complete;
    instance_.save(start_);
  }
  static unsigned reference(const std::string& name) {
    const auto& variables = fmi::table().variables;
    const auto named = [&](const fmi::Variable& v) { return v.name == name; };
    return static_cast<unsigned>(std::find_if(variables.begin(), variables.end(), named) - variables.begin());
  }
  void set(unsigned reference, double value) {
    instance_.set(reference, fmi::table().variables[reference].type, value);
  }
  double get(unsigned reference) { return instance_.get(reference, fmi::Type::real); }
  void step(double H) { instance_.step(instance_.progress.time, H, false); }
  void restore() { instance_.restore(start_); }
  /// The step from the start.
  void repeat(double H) {
    restore();
    step(H);
  }

 private:
  fmi::Instance instance_;
  fmi::Snapshot start_;
};

/// The result of a computation that must not be left out.
inline void keep(double value) {
  [[maybe_unused]] static volatile double sink = 0.0;
  sink = value;
}

}  // namespace bench
