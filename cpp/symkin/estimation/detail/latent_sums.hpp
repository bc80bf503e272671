// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "symkin/estimation/detail/latent_pack.hpp"

namespace symkin::detail {

// Sums over poses, of which every fourth stands in the same lane whatever the processor holds.
template <typename T>
class LatentSums {
  static constexpr Index kLanes = Lanes<T>::kCount;
  static constexpr Index kParts = 4 / kLanes;  // packs that stand side by side
  static constexpr Index kTogether = 4;        // packs whose sums are taken at once

 public:
  LatentSums(const LatentRows& in, const double* weights, bool gradient_alone)
      : in_(in),
        weights_(weights),
        gradient_alone_(gradient_alone),
        bound_(in.legs * in.closures),
        conditions_(in.rows - in.dof),
        size_(in.legs * in.width + in.shared) {
    const std::pair<T**, Index> places[] = {{&sums_, size_ * (size_ + 1)},
                                            {&precisions_, kTogether * bound_ * bound_},
                                            {&multipliers_, kTogether * bound_},
                                            {&crossed_, kTogether * bound_ * in.shared},
                                            {&jacobian_, kTogether * conditions_ * in.shared},
                                            {&weighted_, kTogether * conditions_ * in.shared},
                                            {&rho_, kTogether * conditions_}};
    Index count = 0;
    for (const auto& place : places) {
      count += place.second;
    }
    room_.reset(new T[static_cast<std::size_t>(count)]);  // at once: to align it takes time
    T* next = room_.get();
    for (const auto& [place, size] : places) {
      *place = next;
      next += size;
    }
  }

  void add(double* information, double* gradient) {
    const Index first = gradient_alone_ ? size_ : 0;
    for (Index part = 0; part < kParts; ++part) {
      std::fill(sums(first, 0), sums(size_ + 1, 0), T(0.0));
      for (Index pack = part; pack < packs<T>(in_); pack += kTogether * kParts) {
        for (Index b = 0; b < kTogether; ++b) {
          gather(pack + b * kParts, b);
        }
        add_legs();
        add_shared();
      }
      for (Index row = first; row <= size_; ++row) {
        double* const to = row < size_ ? information + row * size_ : gradient;
        for (Index i = 0; i < (row < size_ ? row + 1 : size_); ++i) {
          to[i] = (part == 0 ? 0 : to[i]) + over_lanes(*sums(row, i));
        }
      }
    }
  }

 private:
  // Neighbours first, so that two packs of two give what one of four gives.
  static double over_lanes(const T& value) {
    double lanes[kLanes];
    Index each[kLanes];
    for (Index lane = 0; lane < kLanes; ++lane) {
      each[lane] = lane;
    }
    Lanes<T>::scatter(value, lanes, each);
    double sum = 0;
    for (Index lane = 0; lane < kLanes; lane += 2) {
      sum += kLanes == 1 ? lanes[0] : lanes[lane] + lanes[lane + 1];
    }
    return sum;
  }
  T* sums(Index row, Index column) { return sums_ + row * size_ + column; }
  T* gradient(Index row) { return sums(size_, row); }

  // What is summed of one pack, weighted.
  SYMKIN_FLATTEN void gather(Index pack, Index b) {
    double weights[kLanes];
    Index lanes[kLanes];
    for (Index lane = 0; lane < kLanes; ++lane) {
      const Index pose = pack * kLanes + lane;
      weights[lane] = pose < in_.count ? weights_[pose] : 0;
      lanes[lane] = lane;
    }
    const T weight = Lanes<T>::gather(weights, lanes);
    const Index some = pack < packs<T>(in_) ? pack : 0;
    const Index r = conditions_;
    own_[b] = in_.room + (some * in_.places.size + in_.places.by_unknowns) * kLanes;
    const Pack<T> g(in_, some, in_.places.conditions);
    const Pack<T> rho(in_, some, in_.places.rho), jacobian(in_, some, in_.places.jacobian);
    for (Index j = 0; j < r; ++j) {
      rho_[j * kTogether + b] = weight * rho[j];
      for (Index s = 0; s < in_.shared; ++s) {
        const T value = jacobian[j * in_.shared + s];
        jacobian_[(j * in_.shared + s) * kTogether + b] = value;
        weighted_[(j * in_.shared + s) * kTogether + b] = weight * value;
      }
    }
    for (Index i = 0; i < bound_; ++i) {
      T multiplier(0.0);
      for (Index j = 0; j < r; ++j) {
        multiplier = multiplier + g[i * r + j] * rho_[j * kTogether + b];
      }
      multipliers_[i * kTogether + b] = multiplier;
      if (gradient_alone_) {
        continue;
      }
      for (Index k = 0; k <= i; ++k) {
        T precision(0.0);
        for (Index j = 0; j < r; ++j) {
          precision = precision + g[i * r + j] * g[k * r + j];
        }
        precision = weight * precision;
        precisions_[(i * bound_ + k) * kTogether + b] = precision;
        precisions_[(k * bound_ + i) * kTogether + b] = precision;
      }
      for (Index s = 0; s < in_.shared; ++s) {
        T crossed(0.0);
        for (Index j = 0; j < r; ++j) {
          crossed = crossed + g[i * r + j] * weighted_[(j * in_.shared + s) * kTogether + b];
        }
        crossed_[(i * in_.shared + s) * kTogether + b] = crossed;
      }
    }
  }

  // sums[t] += x C[row][t] of a row of the legs, for kCount of them, and sums[t] += x a[t], of all
  // packs that are held.
  template <int kCount>
  void add_closure(const T (*x)[kTogether], Index row, Index count, T* sums) const {
    const Index first = row * in_.width;
    for (Index t = 0; t < count; ++t) {
      T some[kCount];
      for (Index k = 0; k < kCount; ++k) {
        some[k] = sums[k * size_ + t];
      }
      for (Index b = 0; b < kTogether; ++b) {
        const T factor = own(b, first + t);
        for (Index k = 0; k < kCount; ++k) {
          some[k] = some[k] + x[k][b] * factor;
        }
      }
      for (Index k = 0; k < kCount; ++k) {
        sums[k * size_ + t] = some[k];
      }
    }
  }
  void add_closure(const T* x, Index row, T* sums) const {
    add_closure<1>(reinterpret_cast<const T(*)[kTogether]>(x), row, in_.width, sums);
  }
  T own(Index b, Index i) const {
    if constexpr (kLanes == 1) {
      return own_[b][i];
    } else {
      return T::load_unaligned(own_[b] + i * kLanes);
    }
  }
  static void add_scaled(const T* x, const T* a, Index count, T* sums) {
    for (Index t = 0; t < count; ++t) {
      T sum = sums[t];
      for (Index b = 0; b < kTogether; ++b) {
        sum = sum + x[b] * a[t * kTogether + b];
      }
      sums[t] = sum;
    }
  }

  SYMKIN_FLATTEN void add_legs() {
    const Index closures = in_.closures, width = in_.width;
    for (Index i = 0; i < bound_; ++i) {
      const Index first = i / closures * width;
      add_closure(multipliers_ + i * kTogether, i, gradient(first));
    }
    // Two rows of the sums at once: what stands at both is read once.
    for (Index leg = 0; leg < in_.legs && !gradient_alone_; ++leg) {
      for (Index s = 0; s < width; s += 2) {
        for (Index other = 0; other < (leg + 1) * closures; ++other) {
          const Index next = s + 1 < width ? s + 1 : s;
          T x[2][kTogether];
          for (Index b = 0; b < kTogether; ++b) {
            const Index first = leg * closures;
            const T* const precisions = precisions_ + other * kTogether + b;
            x[0][b] = precisions[first * bound_ * kTogether] * own(b, first * width + s);
            x[1][b] = precisions[first * bound_ * kTogether] * own(b, first * width + next);
            for (Index i = first + 1; i < first + closures; ++i) {
              x[0][b] = x[0][b] + precisions[i * bound_ * kTogether] * own(b, i * width + s);
              x[1][b] = x[1][b] + precisions[i * bound_ * kTogether] * own(b, i * width + next);
            }
          }
          T* const to = sums(leg * width + s, other / closures * width);
          const Index columns = other / closures < leg ? width : next + 1;  // below the diagonal
          if (s < next) {
            add_closure<2>(x, other, columns, to);
          } else {
            add_closure<1>(x, other, columns, to);
          }
        }
      }
    }
  }

  SYMKIN_FLATTEN void add_shared() {
    const Index shared = in_.shared, first = in_.legs * in_.width;
    for (Index s = 0; s < shared; ++s) {
      for (Index i = 0; i < bound_ && !gradient_alone_; ++i) {
        add_closure(crossed_ + (i * shared + s) * kTogether, i,
                    sums(first + s, i / in_.closures * in_.width));
      }
      for (Index j = 0; j < conditions_; ++j) {
        if (!gradient_alone_) {
          add_scaled(weighted_ + (j * shared + s) * kTogether, jacobian_ + j * shared * kTogether,
                     s + 1, sums(first + s, first));
        }
        add_scaled(jacobian_ + (j * shared + s) * kTogether, rho_ + j * kTogether, 1,
                   gradient(first + s));
      }
    }
  }

  const LatentRows& in_;
  const double* weights_;
  bool gradient_alone_;
  Index bound_, conditions_, size_;  // rows of legs; of a pose; scalars
  std::unique_ptr<T[]> room_;
  T* sums_;                       // the information by rows, and the gradient
  const double* own_[kTogether];  // C of the legs, of packs side by side
  // Of these: G G' between their rows, G rho, G G'C of the shared, G'C,
  // the same weighted, and rho.
  T *precisions_, *multipliers_, *crossed_, *jacobian_, *weighted_, *rho_;
};

}  // namespace symkin::detail
