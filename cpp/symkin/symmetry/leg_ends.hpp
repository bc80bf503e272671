// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/chain_info.hpp"

namespace symkin {

// One end of a leg, base or platform, within its parameters; null where the chain has none. T is
// double or const double.
template <typename T>
struct LegEnd {
  T* radius;  // of a point, or the Hesse distance of a guide
  T* polar_angle;
  T* azimuth;
};

namespace detail {

template <typename T>
T* find_parameter(const ChainInfo& chain, const ParameterInfo& wanted, T* parameters) {
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    if (chain.parameters[i].name == wanted.name) {
      return parameters + i;
    }
  }
  return nullptr;
}

}  // namespace detail

template <typename T>
LegEnd<T> base_end(const ChainInfo& chain, T* parameters) {
  T* const azimuth = detail::find_parameter(chain, parameter::kBaseAngle, parameters);
  return {detail::find_parameter(chain, parameter::kBaseRadius, parameters),
          detail::find_parameter(chain, parameter::kBasePolarAngle, parameters),
          azimuth != nullptr ? azimuth
                             : detail::find_parameter(chain, parameter::kBaseAzimuth, parameters)};
}

template <typename T>
LegEnd<T> platform_end(const ChainInfo& chain, T* parameters) {
  T* const azimuth = detail::find_parameter(chain, parameter::kPlatformAngle, parameters);
  return {detail::find_parameter(chain, parameter::kPlatformRadius, parameters),
          detail::find_parameter(chain, parameter::kPlatformPolarAngle, parameters),
          azimuth != nullptr
              ? azimuth
              : detail::find_parameter(chain, parameter::kPlatformAzimuth, parameters)};
}

}  // namespace symkin
