#include "segment.hpp"

namespace spring {
namespace {

std::vector<Crossing> after_contact(bool compliance, const std::vector<Crossing>& others) {
  std::vector<Crossing> all;
  if (compliance) all = {Crossing::falling, Crossing::rising};
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

}  // namespace

Segment::Segment(const Motion& motion, const Parameters& parameters, int unknowns,
                 const std::vector<Crossing>& crossings)
    : motion_(motion),
      parameters_(parameters),
      contact_(parameters.compliant() ? 0 : -1),
      own_(contact_ + (parameters.compliant() ? 2 : 1)),
      solver_(unknowns, after_contact(parameters.compliant(), crossings)) {}

void Segment::begin(const Start& start) {
  start_ = start;
  loads_ = start.loads.scaled(start.size);
}

void Segment::meet(bool touching, const Series& depth) {
  touching_ = touching;
  contact_sign_ = touching ? 1.0 : -1.0;
  Series distance = depth;
  for (double& coefficient : distance) coefficient *= contact_sign_;
  contact_watch_ = Watch(distance);
}

double Segment::contact_depth(double rise, double s) const {
  const auto& u = loads_.tip;
  return start_.depth + rise - s * (u[1] + s * u[2] / 2);
}

void Segment::contact_events(double rise, double slope, double s, double* g) const {
  if (contact_ < 0) return;
  g[contact_] = contact_watch_.distance(contact_sign_ * contact_depth(rise, s), s);
  g[contact_ + 1] = contact_watch_.rate(contact_sign_ * contact_rate(slope, s), s);
}

}  // namespace spring
