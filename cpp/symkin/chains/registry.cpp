// SPDX-License-Identifier: MIT
#include "symkin/chains/registry.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <utility>

#include "symkin/support/error.hpp"

namespace symkin {

namespace chains {

using Models = std::vector<const ChainModel*>;

// One function a family, each compiled in a unit of its own: the models are the slowest templates.
#define SYMKIN_FAMILY(family) Models family##_models();
#include "symkin_families.inc"
#undef SYMKIN_FAMILY

}  // namespace chains

namespace {

const chains::Models& all_models() {
  static const chains::Models models = [] {
    chains::Models all;
    for (const auto& family : {
#define SYMKIN_FAMILY(family) chains::family##_models(),
#include "symkin_families.inc"
#undef SYMKIN_FAMILY
         }) {
      all.insert(all.end(), family.begin(), family.end());
    }
    return all;
  }();
  return models;
}

Platform platform_of(PoseSpace space) {
  return space == PoseSpace::point         ? Platform::point
         : space == PoseSpace::translating ? Platform::translating
         : space == PoseSpace::spherical   ? Platform::spherical
         : space == PoseSpace::schoenflies ? Platform::schoenflies
                                           : Platform::rigid;
}

using Declared = std::map<std::string, std::unique_ptr<const ChainModel>, std::less<>>;

Declared& declared_models() {
  static Declared models;
  return models;
}

std::mutex& declared_mutex() {
  static std::mutex mutex;
  return mutex;
}

const ChainModel* declared_model_of(std::string_view chain) {
  const std::lock_guard lock(declared_mutex());
  const auto found = declared_models().find(chain);
  return found == declared_models().end() ? nullptr : found->second.get();
}

bool carries(const ChainModel& model, Platform platform) {
  return platform_of(model.info().pose_space) == platform;
}

// Both passive joints prismatic: the leg fixes the platform's orientation and nothing else.
constexpr std::array<std::string_view, 3> kOrientationOnly{"P[R]P", "[R]PP", "PP[R]"};

// A ball for a universal joint leaves the rod to spin, which binds nothing less.
std::string_view bound_as(std::string_view chain) {
  constexpr std::array<std::array<std::string_view, 2>, 3> kSame{
      {{"S[P]S", "U[P]S"}, {"[P]SS", "[P]US"}, {"[R]SS", "[R]US"}}};
  for (const auto& [spinning, name] : kSame) {
    if (chain == spinning) {
      return name;
    }
  }
  return chain;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

[[noreturn]] void refuse(std::string_view chain, Platform platform) {
  const std::string quoted = "\"" + std::string(chain) + "\"";
  if (std::find(kOrientationOnly.begin(), kOrientationOnly.end(), chain) !=
      kOrientationOnly.end()) {
    throw InvalidInput("chain " + quoted +
                       " has two passive prismatic joints: it fixes the platform's orientation "
                       "only, so its leg cannot be identified from a position");
  }
  const auto carried = [&](Platform other) {
    const auto names = chain_names(other);
    return std::find(names.begin(), names.end(), chain) != names.end();
  };
  if (carried(Platform::rigid) && leg_model(chain, Platform::rigid).info().closures > 1) {
    throw InvalidInput("chain " + quoted +
                       " tilts its platform, which its legs bind to planes; expected \"rigid\"");
  }
  if (platform == Platform::translating && (carried(Platform::rigid) || carried(Platform::point))) {
    throw InvalidInput("chain " + quoted +
                       " cannot carry a translating platform: it moves in a plane");
  }
  if (platform == Platform::point && carried(Platform::translating)) {
    throw InvalidInput("chain " + quoted +
                       " cannot carry a point platform, which moves in a plane; expected "
                       "\"rigid\" or \"translating\"");
  }
  if (platform == Platform::point && carried(Platform::rigid)) {
    throw InvalidInput("chain " + quoted +
                       " cannot carry a point platform: it knows the platform by more than a "
                       "point, by a guide on it, a joint that is read against it or its "
                       "orientation");
  }
  const auto names = chain_names(platform);
  if (names.empty()) {
    throw InvalidInput("no known chain carries a schoenflies platform, and chain " + quoted +
                       " is not declared; expected its joints in [chains.NAME]");
  }
  if (platform == Platform::spherical && (carried(Platform::rigid) || carried(Platform::point))) {
    throw InvalidInput("chain " + quoted +
                       " cannot carry a spherical platform, whose links turn about one centre; "
                       "expected \"" +
                       names.front() + "\"");
  }
  const auto nearest =
      std::min_element(names.begin(), names.end(), [&](const auto& a, const auto& b) {
        return edit_distance(chain, a) < edit_distance(chain, b);
      });
  const bool like = edit_distance(chain, *nearest) < chain.size();
  throw InvalidInput("unknown chain " + quoted +
                     (like ? "; the nearest known one is \"" + *nearest + "\" (" : "; expected ") +
                     "joints from base to platform, the actuated one in brackets" +
                     (like ? ")" : ", such as \"" + *nearest + "\"") +
                     "; any other leg is declared joint by joint, in [chains.NAME]");
}

}  // namespace

const ChainModel& leg_model(std::string_view given, Platform platform) {
  const std::string_view chain = bound_as(given);
  for (const ChainModel* model : all_models()) {
    if (model->info().name == chain && carries(*model, platform)) {
      return *model;
    }
  }
  const ChainModel* const declared = declared_model_of(chain);
  if (declared != nullptr && carries(*declared, platform)) {
    return *declared;
  }
  refuse(chain, platform);
}

const ChainModel& declare_chain(const declared::Declaration& declaration) {
  if (const ChainModel* const there = declared_model_of(declaration.name)) {
    return *there;
  }
  auto made = declared::declared_model(declaration);
  const std::lock_guard lock(declared_mutex());
  return *declared_models().try_emplace(declaration.name, std::move(made)).first->second;
}

Platform platform_named(std::string_view name) {
  if (name == "rigid") {
    return Platform::rigid;
  }
  if (name == "point") {
    return Platform::point;
  }
  if (name == "translating") {
    return Platform::translating;
  }
  if (name == "spherical") {
    return Platform::spherical;
  }
  if (name == "schoenflies") {
    return Platform::schoenflies;
  }
  throw InvalidInput("unknown platform \"" + std::string(name) +
                     "\"; expected \"rigid\", \"point\", \"translating\", \"spherical\" or "
                     "\"schoenflies\"");
}

std::vector<std::string> chain_names(Platform platform) {
  std::vector<std::string> names;
  for (const ChainModel* model : all_models()) {
    if (carries(*model, platform)) {
      names.emplace_back(model->info().name);
    }
  }
  return names;
}

}  // namespace symkin
