// Free motion of the spring's top over one segment of a step, as an implicit system for IDA.
//
// With R the Taylor polynomial of the start (taylor.hpp), scaled time s = τ/H, w = ẏ − Ṙ:
//     q = y − R,   p = H w,   A = ∫₀ˢ q,   B = ∫₀ˢ A,   e = D − ∫ (α_s Ṙ² + d_R) dτ
//     F = ( q' − p,   p' − H²[ÿ(y, ẏ, τ) − R̈],   A' − q,   B' − A,   e' − H [α_s w (2Ṙ + w) + d − d_R] ) = 0,
// D the dissipated energy, d what the contact dissipates and d_R its Taylor polynomial. ÿ − R̈ is evaluated without
// cancellation (motion.hpp). q, p, A, B are lengths; ∫y = ∫R + H A and ∫∫y = ∫∫R + H² B. All unknowns are under error
// control, see tolerances in flight.cpp.
//
// Events: [stop] y − φ falls to 0; [contact] see segment.hpp.
#pragma once

#include "segment.hpp"

namespace spring {

class Flight final : public Segment {
 public:
  Flight(const Motion& motion, const Parameters& parameters);

  Event run(const Start& start) override;
  double displacement() const override;

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;
  void events(double s, const double* Y, double* g) const noexcept override;

 private:
  void prepare();
  void finish();

  const int stop_;  ///< event function, as contact_
  Taylor R_;
  Motion::Remainder remainder_;
  Series contact_taylor_{}, dissipation_taylor_{};  ///< contact force and its loss d_R, as far as R accounts for them
  int contact_order_ = -1;                          ///< of these
  Watch stop_watch_;
};

}  // namespace spring
