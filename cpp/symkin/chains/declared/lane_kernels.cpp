// SPDX-License-Identifier: MIT

// Compiled three times on x86-64, see chains/detail/kernels.hpp: a pose a lane.
#include <limits>

#include "symkin/chains/declared/lane_loops.hpp"
#include "symkin/chains/declared/lane_qr.hpp"
#include "symkin/chains/detail/kernels.hpp"
#include "symkin/support/processor.hpp"

namespace symkin::declared {

template <typename T>
class LaneAssembly {
  using Mask = typename Lanes<T>::Mask;
  using Rows = detail::LaneRows<T>;
  using Qr = LaneQr<T, kMostEquations, kMostJoints>;

 public:
  LaneAssembly(const LaneLeg& leg, const Elimination& order)
      : leg_(leg),
        loops_(leg),
        qr_(order),
        next_(order),
        work_(static_cast<std::size_t>(leg.scalar_count)) {}

  static void close(const LaneLeg& leg, const double* poses, const double* starts, Index count,
                    double* joints, Closed* closed) {
    LaneAssembly assembly(leg, *leg.moving);
    for (Index first = 0; first < count; first += Lanes<T>::kCount) {
      const Rows rows(first, count);
      T own[kMostJoints];
      assembly.stand(rows, poses, starts, own);
      const Ends ends = assembly.newton(own);
      Mask found = ends.found & assembly.on_branch(assembly.qr_.orientation());
      if (leg.exact) {
        found = found & assembly.meets_all();
      }
      for (int i = 0; i < leg.own_count; ++i) {
        rows.write(own[i], joints + i, leg.own_count);
      }
      tell(rows, found, ends, closed);
    }
  }

  static void closures(const LaneLeg& leg, const double* poses, const double* read,
                       const double* starts, Index count, int first_closure, int closures,
                       double* to, Closed* closed) {
    LaneAssembly assembly(leg, *leg.passive);
    for (Index first = 0; first < count; first += Lanes<T>::kCount) {
      const Rows rows(first, count);
      T own[kMostJoints];
      assembly.stand(rows, poses, starts, own);
      if (leg.read >= 0) {
        own[leg.read] = rows.read(read, 1);
      }
      const Ends ends = assembly.newton(own);
      const T by_read = assembly.find_reciprocal(assembly.qr_);
      const bool from_home = starts == nullptr;
      tell(rows, from_home ? ends.found & assembly.on_branch(by_read) : ends.found, ends, closed);
      const Index width = kClosureNumbers + leg.scalar_count;
      for (int i = 0; i < closures; ++i) {
        assembly.write(assembly.reciprocal_[first_closure + i], rows, to + i * width,
                       closures * width);
      }
    }
  }

  static void slopes(const LaneLeg& leg, const double* poses, const double* starts, Index count,
                     double* slopes) {
    LaneAssembly assembly(leg, *leg.moving);
    Qr passive(*leg.passive);
    const T none(std::numeric_limits<double>::quiet_NaN());
    for (Index first = 0; first < count; first += Lanes<T>::kCount) {
      const Rows rows(first, count);
      T own[kMostJoints];
      assembly.stand(rows, poses, starts, own);
      const Ends ends = assembly.newton(own);
      const T slope = assembly.find_reciprocal(passive);
      rows.write(Lanes<T>::select(ends.found, slope, none), slopes, 1);
    }
  }

 private:
  void stand(const Rows& rows, const double* poses, const double* starts, T* own) {
    loops_.stand(rows, poses);
    for (int i = 0; i < leg_.own_count; ++i) {
      own[i] = starts == nullptr ? T(leg_.home[i]) : rows.read(starts + i, leg_.own_count);
    }
  }

  // How Newton's method ended: at rest, near it, or given up.
  struct Ends {
    Mask found, near;
  };

  static void tell(const Rows& rows, const Mask& found, const Ends& ends, Closed* closed) {
    for (int lane = 0; lane < Lanes<T>::kCount; ++lane) {
      const bool at_rest = Lanes<T>::lane(ends.found, lane);
      const bool open = Lanes<T>::lane(ends.near, lane) && !at_rest;
      closed[rows.row(lane)] = Lanes<T>::lane(found, lane) ? Closed::yes
                               : open                      ? Closed::perhaps
                                                           : Closed::no;
    }
  }

  // As Assembly::newton(), until a step is short; then once more with the same derivatives. A lane
  // that has come so far, or is given up, waits for the others as it is.
  Ends newton(T* own) {
    constexpr int kMost = 30;
    constexpr double kPatience = 6;
    constexpr double kLongest = 0.5;  // m and rad
    constexpr double kShort = 1e-5;
    constexpr double kNoStep = 1e-9;
    const Mask nowhere = T(0.0) > T(0.0);
    loops_.walk(own);
    if (qr_.rank() == 0) {
      return {!nowhere, !nowhere};
    }
    Mask waits = nowhere, near = nowhere;
    T shortest(std::numeric_limits<double>::infinity()), since(0.0);
    for (int i = 0; i < kMost; ++i) {
      loops_.columns(columns_);
      if (Lanes<T>::any(waits)) {
        next_.factorise(columns_);
        qr_.take(!waits, next_);
      } else {
        qr_.factorise(columns_);
      }
      const T largest = step(waits, kLongest, own);
      const Mask halved = largest < T(0.5) * shortest;
      since = Lanes<T>::select(halved, T(0.0), since + T(1.0));
      shortest = Lanes<T>::select(halved, largest, shortest);
      near = near | !(waits | (largest > T(kShort)));
      waits = waits | near | !(since < T(kPatience));
      if (!Lanes<T>::any(!waits)) {
        break;
      }
    }
    return {step(nowhere, kLongest, own) < T(kNoStep), near};
  }

  T step(const Mask& waits, double longest, T* own) {
    using std::abs;
    T missed[kMostEquations], step[kMostJoints];
    loops_.residual(missed);
    qr_.solve(missed, step);
    T largest(0.0);
    for (int k = 0; k < qr_.rank(); ++k) {
      const T size = abs(step[k]);
      largest = Lanes<T>::select(size < largest, largest, size);  // NaN stays
    }
    const T limit(longest);
    T share = Lanes<T>::select(largest > limit, limit / largest, T(1.0));
    for (int k = 0; k < qr_.rank(); ++k) {
      T& moved = own[qr_.column(k)];
      moved = Lanes<T>::select(waits, moved, moved - share * step[k]);
    }
    loops_.walk(own);
    return largest;
  }

  Mask on_branch(const T& side) const {
    const Mask near = loops_.on_this_side_of_half_a_turn();
    return leg_.side == 0 ? near : near & (T(leg_.side) * side > T(0.0));
  }

  Mask meets_all() const {
    constexpr double kClosed = 1e-9;  // m and rad
    using std::abs;
    T missed[kMostEquations];
    loops_.residual(missed);
    Mask all = T(0.0) == T(0.0);
    for (int i = 0; i < leg_.equations; ++i) {
      all = all & (abs(missed[i]) < T(kClosed));
    }
    return all;
  }

  T dot(const T* a, const T* b) const {
    T sum(0.0);
    for (int i = 0; i < leg_.equations; ++i) {
      sum = sum + a[i] * b[i];
    }
    return sum;
  }

  // As Assembly::reciprocal(), of the passive joints; returns what the first closure gains by the
  // first read joint.
  T find_reciprocal(Qr& passive) {
    loops_.columns(columns_);
    passive.factorise(columns_);
    const int count = leg_.equations - passive.rank();
    for (int i = 0; i < count; ++i) {
      passive.complement(i, leg_.equations, reciprocal_[i]);
    }
    const T side = passive.orientation();
    if (leg_.read < 0 || count == 1) {
      turn_last(count, side);
      return leg_.read < 0 ? T(0.0) : dot(reciprocal_[0], columns_[leg_.read]);
    }
    // A reflection carries the work with the reading into the first closure.
    using std::sqrt;
    T work[kMostEquations];
    T square(0.0);
    for (int i = 0; i < count; ++i) {
      work[i] = dot(reciprocal_[i], columns_[leg_.read]);
      square = square + work[i] * work[i];
    }
    const T size = sqrt(square);
    square = square - work[0] * work[0];
    work[0] = work[0] - size;
    square = square + work[0] * work[0];
    const T share = Lanes<T>::select(square > T(0.0), T(2.0) / square, T(0.0));
    for (int row = 0; row < leg_.equations; ++row) {
      T along(0.0);
      for (int i = 0; i < count; ++i) {
        along = along + reciprocal_[i][row] * work[i];
      }
      for (int i = 0; i < count; ++i) {
        reciprocal_[i][row] = reciprocal_[i][row] - share * along * work[i];
      }
    }
    turn_last(count, Lanes<T>::select(square > T(0.0), -side, side));
    return size;
  }

  void turn_last(int count, const T& side) {
    for (int row = 0; row < leg_.equations; ++row) {
      reciprocal_[count - 1][row] = side * reciprocal_[count - 1][row];
    }
  }

  void write(const T* wrench, const Rows& rows, double* to, Index stride) {
    T missed[kMostEquations], pose[6], joints[kMostJoints];
    loops_.residual(missed);
    loops_.work(wrench, pose, joints, work_.data());
    const auto put = [&](const T& value) { rows.write(value, to++, stride); };
    put(dot(wrench, missed));
    for (const T& each : pose) {
      put(each);
    }
    put(leg_.read >= 0 ? joints[leg_.read] : T(0.0));
    for (const T& each : work_) {
      put(each);
    }
  }

  const LaneLeg& leg_;
  LaneLoops<T> loops_;
  Qr qr_, next_;
  T columns_[kMostJoints][kMostEquations], reciprocal_[kMostEquations][kMostEquations];
  std::vector<T> work_;
};

template <typename T>
struct DeclaredKernelsOf {
  static constexpr DeclaredKernels kTable{LaneAssembly<T>::close, LaneAssembly<T>::closures,
                                          LaneAssembly<T>::slopes};
};

#if defined(SYMKIN_COMPILES_AVX512)
const DeclaredKernels* declared_kernels_avx512() {
  return &DeclaredKernelsOf<chains::Scalar<xsimd::avx512f>>::kTable;
}
#elif defined(SYMKIN_COMPILES_AVX2)
const DeclaredKernels* declared_kernels_avx2() {
  return &DeclaredKernelsOf<chains::Scalar<xsimd::avx2>>::kTable;
}
#else
#ifdef SYMKIN_HAS_AVX2
const DeclaredKernels* declared_kernels_avx2();
#endif
#ifdef SYMKIN_HAS_AVX512
const DeclaredKernels* declared_kernels_avx512();
#endif

const DeclaredKernels& declared_kernels([[maybe_unused]] Index count) {
#ifdef SYMKIN_HAS_AVX512
  constexpr Index kFew = 4;  // which wider lanes would not do faster
  if (count > kFew && processor_has(Processor::avx512)) {
    return *declared_kernels_avx512();
  }
#endif
#ifdef SYMKIN_HAS_AVX2
  if (processor_has(Processor::avx2)) {
    return *declared_kernels_avx2();
  }
#endif
  return DeclaredKernelsOf<chains::Scalar<xsimd::default_arch>>::kTable;
}
#endif

}  // namespace symkin::declared
