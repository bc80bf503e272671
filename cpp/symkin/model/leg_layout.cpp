// SPDX-License-Identifier: MIT
#include "symkin/model/leg_layout.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "symkin/model/pose_space.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

using Names = std::vector<std::string_view>;

Index place_of(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) - names.begin();
}

// The names of the chains' sensors, or of all the rest.
Names names_of(const std::vector<const ChainModel*>& chains, bool sensors) {
  Names names;
  for (const ChainModel* chain : chains) {
    for (const auto& [name, role, held] : chain->info().parameters) {
      if (is_sensor(role.kind) == sensors &&
          place_of(names, name) == static_cast<Index>(names.size())) {
        names.push_back(name);
      }
    }
  }
  return names;
}

std::vector<Index> columns_of(const ChainInfo& chain, const Names& layout) {
  std::vector<Index> columns;
  for (const ParameterInfo& parameter : chain.parameters) {
    columns.push_back(place_of(layout, parameter.name));
  }
  return columns;
}

// What a leg of the chain is in the layout.
ChainInfo info_in(const Names& layout, const ChainInfo& chain) {
  ChainInfo info = chain;
  info.parameters.clear();
  for (const std::string_view name : layout) {
    info.parameters.push_back({name, {End::none, ParameterKind::absent}});
  }
  const std::vector<Index> columns = columns_of(chain, layout);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    info.parameters[static_cast<std::size_t>(columns[i])] = chain.parameters[i];
  }
  return info;
}

// A chain's model between parameters of the layout.
class ModelInLayout final : public LegModel {
 public:
  ModelInLayout(const ChainModel& chain, const Names& layout)
      : LegModel(info_in(layout, chain.info())),
        chain_(chain),
        columns_(columns_of(chain.info(), layout)) {}

  void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                          Eigen::Ref<Vector> readings) const override {
    chain_.inverse_kinematics(own(parameters), working_mode, poses, readings);
  }
  void reach_margin(ConstVector parameters, ConstRows poses,
                    Eigen::Ref<Vector> margins) const override {
    chain_.reach_margin(own(parameters), poses, margins);
  }
  void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                 ClosureRows& rows) const override {
    chain_.linearise(own(parameters), poses, readings, rows);
    RowMatrix by_parameters = RowMatrix::Zero(rows.by_parameters.rows(), parameter_count());
    by_parameters(kAll, columns_) = rows.by_parameters;
    rows.by_parameters = std::move(by_parameters);
  }
  void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                      ClosureRows& rows) const override {
    chain_.linearise_pose(own(parameters), poses, readings, rows);
  }
  void reading_differences(ConstVector parameters, ConstVector readings, ConstVector others,
                           Eigen::Ref<Vector> differences) const override {
    chain_.reading_differences(own(parameters), readings, others, differences);
  }
  double sensor_gain(ConstVector parameters, double reading) const override {
    return chain_.sensor_gain(own(parameters), reading);
  }
  RowMatrix joint_centres(ConstVector parameters, ConstVector pose, double reading) const override {
    return chain_.joint_centres(own(parameters), pose, reading);
  }

 private:
  Vector own(ConstVector parameters) const { return parameters(columns_); }

  const ChainModel& chain_;
  std::vector<Index> columns_;
};

// Throws unless legs of both chains can carry one platform together.
void check_together(const ChainInfo& a, const ChainInfo& b) {
  const std::string both = "legs of the chains \"" + std::string(a.name) + "\" and \"" +
                           std::string(b.name) + "\" cannot carry one platform: ";
  if (a.pose_space != b.pose_space) {
    throw InvalidInput(both + "a " + std::string(to_string(a.pose_space)) + " and a " +
                       std::string(to_string(b.pose_space)) + " one");
  }
  for (const ChainInfo& chain : {a, b}) {
    if (chain.closures > 1) {
      throw InvalidInput(both + "those of \"" + std::string(chain.name) +
                         "\" bind it to planes, and go with their like alone");
    }
  }
}

}  // namespace

LegModels in_one_layout(const std::vector<const ChainModel*>& chains) {
  Names layout = names_of(chains, false);
  const Names sensors = names_of(chains, true);
  layout.insert(layout.end(), sensors.begin(), sensors.end());
  std::map<const ChainModel*, std::shared_ptr<const LegModel>> models;
  LegModels of_legs;
  for (const ChainModel* chain : chains) {
    std::shared_ptr<const LegModel>& model = models[chain];
    if (model == nullptr) {
      if (chain != chains.front()) {
        check_together(chains.front()->info(), chain->info());
      }
      model = std::make_shared<ModelInLayout>(*chain, layout);
    }
    of_legs.push_back(model);
  }
  return of_legs;
}

Vector in_layout(const ChainInfo& layout, const ChainInfo& chain, ConstVector parameters) {
  if (parameters.size() != static_cast<Index>(chain.parameters.size())) {
    throw InvalidInput("the leg has " + std::to_string(parameters.size()) + " parameters; chain " +
                       std::string(chain.name) + " has " + std::to_string(chain.parameters.size()));
  }
  Names names;
  for (const ParameterInfo& parameter : layout.parameters) {
    names.push_back(parameter.name);
  }
  const std::vector<Index> columns = columns_of(chain, names);
  Vector values = Vector::Zero(static_cast<Index>(names.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    values[columns[i]] = parameters[static_cast<Index>(i)];
  }
  return values;
}

}  // namespace symkin
