// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/roles.hpp"

// The parameters that chains share. A name is what files say, a role what the program goes by: a
// guide on the base has a "base_radius" too, its distance.
namespace symkin {

inline constexpr ParameterInfo kProximalLength{"proximal_length",
                                               {End::none, ParameterKind::length}};
inline constexpr ParameterInfo kDistalLength{"distal_length", {End::none, ParameterKind::length}};
inline constexpr ParameterInfo kProximalArc{"proximal_arc", {End::none, ParameterKind::arc}};
inline constexpr ParameterInfo kDistalArc{"distal_arc", {End::none, ParameterKind::arc}};
inline constexpr ParameterInfo kGuideOffset{"guide_offset",
                                            {End::none, ParameterKind::eccentricity}};

inline constexpr ParameterInfo kPulleyRadius{"pulley_radius",
                                             {End::none, ParameterKind::pulley_radius}};

inline constexpr ParameterInfo kBaseRadius{"base_radius", {End::base, ParameterKind::radius}};
inline constexpr ParameterInfo kBaseAngle{"base_angle", {End::base, ParameterKind::azimuth}};
inline constexpr ParameterInfo kBasePolarAngle{"base_polar_angle",
                                               {End::base, ParameterKind::polar_angle}};
inline constexpr ParameterInfo kBaseAzimuth{"base_azimuth", {End::base, ParameterKind::azimuth}};
inline constexpr ParameterInfo kBaseHeight{"base_height", {End::base, ParameterKind::height}};
inline constexpr ParameterInfo kGuideAzimuth{"guide_azimuth",
                                             {End::base, ParameterKind::guide_azimuth}};
inline constexpr ParameterInfo kGuideElevation{"guide_elevation",
                                               {End::base, ParameterKind::guide_elevation}};
inline constexpr ParameterInfo kGuideSwing{"guide_swing", {End::base, ParameterKind::guide_swing}};
inline constexpr ParameterInfo kAxisAzimuth{"axis_azimuth",
                                            {End::base, ParameterKind::axis_azimuth}};
inline constexpr ParameterInfo kAxisElevation{"axis_elevation",
                                              {End::base, ParameterKind::axis_elevation}};
inline constexpr ParameterInfo kAxisSwing{"axis_swing", {End::base, ParameterKind::axis_swing}};
inline constexpr ParameterInfo kBaseGuideDistance{"base_radius",
                                                  {End::base, ParameterKind::direction_distance}};
inline constexpr ParameterInfo kBaseGuideAngle{"base_angle",
                                               {End::base, ParameterKind::direction_azimuth}};

inline constexpr ParameterInfo kPlatformRadius{"platform_radius",
                                               {End::platform, ParameterKind::radius}};
inline constexpr ParameterInfo kPlatformAngle{"platform_angle",
                                              {End::platform, ParameterKind::azimuth}};
inline constexpr ParameterInfo kPlatformPolarAngle{"platform_polar_angle",
                                                   {End::platform, ParameterKind::polar_angle}};
inline constexpr ParameterInfo kPlatformAzimuth{"platform_azimuth",
                                                {End::platform, ParameterKind::azimuth}};
inline constexpr ParameterInfo kPlatformHeight{"platform_height",
                                               {End::platform, ParameterKind::height}};
inline constexpr ParameterInfo kPlatformGuideDistance{
    "platform_radius", {End::platform, ParameterKind::direction_distance}};
inline constexpr ParameterInfo kPlatformGuideAngle{
    "platform_angle", {End::platform, ParameterKind::direction_azimuth}};

}  // namespace symkin
