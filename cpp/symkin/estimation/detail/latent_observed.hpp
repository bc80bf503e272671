// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <type_traits>

#include "symkin/estimation/detail/factors.hpp"
#include "symkin/estimation/detail/latent_pack.hpp"
#include "symkin/model/pose.hpp"

namespace symkin::detail {

// y, V, B and C of the observations beside the readings, by jets: of orientations in the directions
// that turn something, of all else in the first N of a Scene.
template <typename T, int N>
class ObservedLanes {
  static constexpr bool kFrames = N > factors::kBase;  // whether they may be free
  using Placed = Jet<T, N>;
  using Turned = Jet<T, kFrames ? 9 : 3>;
  template <typename D>
  using Scene = factors::Scene<D>;
  static constexpr Index kOfBase = 0, kOfSlope = 9;  // of LatentRows::base_turns

 public:
  static void fill(const LatentRows& in) {
    T target[12];
    for (Index i = 0; i < 12; ++i) {
      target[i] = T(in.target[i]);
    }
    Scene<Placed> placed;
    placed.target_position = factors::variable_position<Placed>(target, factors::kTarget);
    placed.target_rotation = factors::variable_rotation<Placed>(target + 3, factors::kTarget + 3);
    Scene<Turned> turned;
    turned.target_rotation = factors::variable_rotation<Turned>(target + 3, 6);
    bool turns = false;  // whether the rotation moves anything but orientations
    for (Index k = 0; k < in.observation_count; ++k) {
      const LatentRows::Kind kind = in.observations[k].kind;
      turns = turns || (kind != LatentRows::Kind::reported_position &&
                        kind != LatentRows::Kind::reported_orientation);
    }
    for (Index pack = 0; pack < packs<T>(in); ++pack) {
      const LaneRows<T> at(pack * Lanes<T>::kCount, in.count);
      T frame[12];
      read_frame(in, at, frame);
      if (pack == 0 || in.base_stride > 0) {
        T base[12];
        for (Index i = 0; i < 12; ++i) {
          base[i] = at.read(in.bases + i, in.base_stride);
        }
        placed.base_position = factors::variable_position<Placed>(base, factors::kBase);
        placed.base_rotation = factors::variable_rotation<Placed>(base + 3, factors::kBase + 3);
        turned.base_rotation = factors::variable_rotation<Turned>(base + 3, 3);
      }
      placed.position = factors::variable_position<Placed>(frame, factors::kPose);
      if (turns) {
        placed.rotation = factors::variable_rotation<Placed>(frame + 3, factors::kPose + 3);
      }
      turned.rotation = factors::variable_rotation<Turned>(frame + 3, 0);
      for (Index k = 0; k < in.observation_count; ++k) {
        any(in, pack, at, placed, turned, in.observations[k]);
      }
    }
  }

 private:
  // Of the poses: position, and the rotation by rows.
  static void read_frame(const LatentRows& in, const LaneRows<T>& at, T* frame) {
    const auto coordinate = [&](Index i) { return at.read(in.poses + i, in.coordinates); };
    for (Index i = 0; i < 12; ++i) {
      frame[i] = i < in.position ? coordinate(i) : T(i == 3 || i == 7 || i == 11 ? 1.0 : 0.0);
    }
    if (in.coordinates == in.position + 1) {
      Lanes<T>::cosine_sine(coordinate(in.position), frame[3], frame[6]);
      frame[4] = -frame[6];
      frame[7] = frame[3];
    } else if (in.coordinates > in.position) {
      T quaternion[4];
      for (Index i = 0; i < 4; ++i) {
        quaternion[i] = coordinate(in.position + i);
      }
      const Turn<T> turn = turn_of(quaternion);
      for (std::size_t i = 0; i < 9; ++i) {
        frame[3 + i] = turn[i / 3][i % 3];
      }
    }
  }

  static void any(const LatentRows& in, Index pack, const LaneRows<T>& at,
                  const Scene<Placed>& placed, const Scene<Turned>& turned,
                  const LatentRows::Observation& observation) {
    switch (observation.kind) {
      case LatentRows::Kind::position:
        return one<factors::MeasuredPosition>(in, pack, at, placed, observation);
      case LatentRows::Kind::orientation:
        return one<factors::MeasuredOrientation>(in, pack, at, turned, observation);
      case LatentRows::Kind::reported_position:
        return one<factors::ReportedPosition>(in, pack, at, placed, observation);
      case LatentRows::Kind::reported_orientation:
        return one<factors::ReportedOrientation>(in, pack, at, turned, observation);
      case LatentRows::Kind::point:
        return one<factors::TargetPoint>(in, pack, at, placed, observation);
      case LatentRows::Kind::distance:
        return one<factors::Distance>(in, pack, at, placed, observation);
      case LatentRows::Kind::height:
        return one<factors::Height>(in, pack, at, placed, observation);
      case LatentRows::Kind::attitude:
        return one<factors::Attitude>(in, pack, at, turned, observation);
      case LatentRows::Kind::turn:
        return one<factors::Turn>(in, pack, at, turned, observation);
      case LatentRows::Kind::position_along:
        return one<factors::Along<factors::MeasuredPosition>>(in, pack, at, placed, observation);
      case LatentRows::Kind::point_along:
        return one<factors::Along<factors::TargetPoint>>(in, pack, at, placed, observation);
    }
  }

  // Where a direction of a scalar (of the pose, or of both frames from 6 on) is among the jet's;
  // -1: it has none.
  template <typename D>
  static int direction(int scalar) {
    if (std::is_same_v<D, Placed>) {
      const int first = scalar < 6 ? factors::kPose : factors::kBase - 6;
      return first + scalar < N ? first + scalar : -1;
    }
    const int turn = scalar % 6 - 3 + scalar / 6 * 3;
    return scalar % 6 >= 3 && turn < D::DIMENSION ? turn : -1;
  }

  // By component i of both frames' twelve. Where the base stands at exp([w]) R_B, what turns R_B
  // comes through exp([w]), and what changes w through its left Jacobian.
  template <typename D>
  static T by_frame(const LatentRows& in, const LaneRows<T>& at, const D& misfit, int i,
                    Index through) {
    if (i < 3 || i >= 6 || in.base_stride == 0) {
      return misfit.v[direction<D>(6 + i)];
    }
    T sum(0.0);
    for (int k = 0; k < 3; ++k) {
      sum += misfit.v[direction<D>(9 + k)] * at.read(in.base_turns + through + 3 * k + i - 3, 18);
    }
    return sum;
  }

  template <typename Factor, typename D>
  SYMKIN_FLATTEN static void one(const LatentRows& in, Index pack, const LaneRows<T>& at,
                                 const Scene<D>& scene,
                                 const LatentRows::Observation& observation) {
    const Pack<T> y(in, pack, in.places.misfits), v(in, pack, in.places.variances);
    const Pack<T> b(in, pack, in.places.by_pose), c(in, pack, in.places.by_shared);
    T measured[Factor::kValues];
    for (Index i = 0; i < Factor::kValues; ++i) {
      measured[i] = at.read(in.values + observation.values + i, in.value_count);
    }
    if (observation.zero >= 0) {
      measured[0] = measured[0] + T(in.scalars[observation.zero]);
    }
    std::array<D, static_cast<std::size_t>(Factor::kOwn)> own{};
    for (int i = 0; i < Factor::kOwn; ++i) {
      own[static_cast<std::size_t>(i)] =
          factors::variable<D>(T(in.scalars[observation.own + i]), factors::kOwn + i);
    }
    const auto misfits = Factor::misfit(scene, own, measured);
    const T zero(0.0);
    for (Index k = 0; k < Factor::kRows; ++k) {
      const Index row = observation.rows[k];
      if (row < 0) {
        continue;
      }
      const D& misfit = misfits[static_cast<std::size_t>(k)];
      const T variance = at.read(in.variances + row, in.rows);
      const auto taken = variance >= zero;
      const auto where_taken = [&](const T& value) { return Lanes<T>::select(taken, value, zero); };
      y.set(row, where_taken(misfit.a));
      v.set(row, where_taken(variance));
      for (Index i = 0; i < in.dof; ++i) {
        const int along = direction<D>(static_cast<int>(in.slots[i]));
        b.set(row * in.dof + i, along < 0 ? zero : where_taken(misfit.v[along]));
      }
      const Index first = (row - in.legs * in.closures) * in.shared;
      for (Index i = 0; i < in.shared; ++i) {
        c.set(first + i, zero);
      }
      for (int i = 0; kFrames && i < 12; ++i) {
        if (direction<D>(6 + i) < 0) {
          continue;
        }
        if (in.shared_of[i] >= 0) {
          c.set(first + in.shared_of[i], where_taken(by_frame(in, at, misfit, i, kOfBase)));
        }
        for (Index j = 0; i < 6 && j < in.covariate_count; ++j) {
          const Index slope = in.shared_of[in.first_slope + 6 * j + i];
          if (slope >= 0) {
            const T covariate = at.read(in.base_covariates + j, in.covariate_count);
            c.set(first + slope, where_taken(covariate * by_frame(in, at, misfit, i, kOfSlope)));
          }
        }
      }
      if (observation.zero >= 0 && in.shared_of[12 + observation.zero] >= 0) {
        c.set(first + in.shared_of[12 + observation.zero], where_taken(T(-1.0)));
      }
      for (int i = 0; N > factors::kOwn && i < Factor::kOwn; ++i) {
        const Index shared = in.shared_of[12 + observation.own + i];
        if (shared >= 0) {
          c.set(first + shared, where_taken(misfit.v[factors::kOwn + i]));
        }
      }
    }
  }
};

}  // namespace symkin::detail
