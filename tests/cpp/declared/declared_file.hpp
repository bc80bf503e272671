// SPDX-License-Identifier: MIT
#pragma once

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "declared/declared_numbers.hpp"

// All declared legs of the reference, read where its file is there.
namespace symkin::declared::reference {

// As much of JSON as the file has: escaped are quotation marks alone.
struct Json {
  double number = 0;
  bool truth = false;
  std::string text;
  std::vector<Json> items;
  std::map<std::string, Json> members;

  const Json& operator[](const std::string& key) const { return members.at(key); }
  bool has(const std::string& key) const { return members.count(key) > 0; }
  std::vector<double> numbers() const {
    std::vector<double> all;
    for (const Json& each : items) {
      all.push_back(each.number);
    }
    return all;
  }
};

inline Json read_json(const char*& at) {
  const auto skip = [&] {
    while (std::isspace(static_cast<unsigned char>(*at)) != 0 || *at == ',' || *at == ':') {
      ++at;
    }
  };
  const auto string = [&] {
    std::string text;
    for (++at; *at != '"'; ++at) {
      at += *at == '\\' ? 1 : 0;
      text += *at;
    }
    ++at;
    return text;
  };
  Json made;
  skip();
  if (*at == '{') {
    for (++at, skip(); *at != '}'; skip()) {
      const std::string key = string();
      made.members[key] = read_json(at);
    }
    ++at;
  } else if (*at == '[') {
    for (++at, skip(); *at != ']'; skip()) {
      made.items.push_back(read_json(at));
    }
    ++at;
  } else if (*at == '"') {
    made.text = string();
  } else if (std::isalpha(static_cast<unsigned char>(*at)) != 0) {  // true, false, null
    made.truth = *at == 't';
    while (std::isalpha(static_cast<unsigned char>(*at)) != 0) {
      ++at;
    }
  } else {
    char* end = nullptr;
    made.number = std::strtod(at, &end);
    at = end;
  }
  return made;
}

inline TransformValues transform_of(const Json& json) {
  const std::vector<double> xyz = json["xyz"].numbers();
  const std::vector<double> q = json["quaternion"].numbers();
  const Eigen::Matrix3d turn = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
  const double pitch = std::atan2(-turn(2, 0), std::hypot(turn(0, 0), turn(1, 0)));
  const bool upright = std::hypot(turn(0, 0), turn(1, 0)) < 1e-12;
  const double yaw = upright ? 0 : std::atan2(turn(1, 0), turn(0, 0));
  const double roll = upright ? std::atan2(pitch > 0 ? turn(0, 1) : -turn(0, 1), turn(1, 1))
                              : std::atan2(turn(2, 1), turn(2, 2));
  return {0, xyz[0], xyz[1], xyz[2], roll, pitch, yaw, 0, 0, 0};
}

inline std::vector<Step> steps_of(const Json& json) {
  std::vector<Step> steps;
  for (const Json& each : json.items) {
    const std::string& name = each.text;
    steps.push_back(name == "pose"
                        ? Step{Step::Kind::pose}
                        : Step{name[0] == 'T' ? Step::Kind::transform : Step::Kind::joint,
                               std::atoi(name.c_str() + 1)});
  }
  return steps;
}

inline Leg leg_of(const Json& json) {
  static const std::map<std::string, Compares> kinds = {{"pose", Compares::pose},
                                                        {"point", Compares::point},
                                                        {"rotation", Compares::rotation},
                                                        {"planar pose", Compares::planar_pose},
                                                        {"planar point", Compares::planar_point}};
  Leg leg;
  const std::string& note = json["note"].text;
  leg.name = json["name"].text + ", " + note.substr(0, note.find('.'));
  leg.platform = json["platform"].text;
  for (const Json& each : json["joints"].items) {
    Joint joint;
    joint.kind = each["kind"].text == "R" ? JointKind::turn : JointKind::slide;
    joint.axis = Eigen::Vector3d(each["axis"].numbers().data());
    joint.read = each.has("read") && each["read"].truth;
    if (each.has("follows")) {
      const std::string& followed = each["follows"].text;
      joint.follows =
          followed[0] == 'J' ? std::atoi(followed.c_str() + 1) : static_cast<int>(Joint::kPoseYaw);
      joint.ratio = each["ratio"].number;
      joint.offset = each["offset"].number;
    }
    leg.joints.push_back(joint);
  }
  for (const Json& each : json["transforms"].items) {
    leg.transforms.push_back(transform_of(each));
  }
  for (const Json& each : json["loops"].items) {
    leg.loops.push_back(
        {steps_of(each["left"]), steps_of(each["right"]), kinds.at(each["compares"].text)});
  }
  leg.home_pose = json["home"]["pose"].numbers();
  leg.home_joints = json["home"]["joints"].numbers();
  leg.closures = static_cast<int>(json["counts"]["closures"].number);
  for (const Json& each : json["cases"].items) {
    Case one{each["pose"].numbers(), each["joints"].numbers(), {}, {}};
    for (const double pivot : each["pivot_columns"].numbers()) {
      one.pivots.push_back(static_cast<int>(pivot));
    }
    for (const Json& row : each["reduced_rows"].items) {
      one.rows.push_back(row.numbers());
    }
    leg.cases.push_back(one);
  }
  return leg;
}

// Those of the file with all their cases, or some of them with one case where there is no file.
inline std::vector<Leg> all_legs() {
  const std::filesystem::path file = std::filesystem::path(SYMKIN_SOURCE_DIR).parent_path() /
                                     "shared" / "reference" / "declared_legs.json";
  std::ifstream stream(file);
  if (!stream) {
    return legs;
  }
  std::stringstream text;
  text << stream.rdbuf();
  const std::string all = text.str();
  const char* at = all.c_str();
  const Json whole = read_json(at);
  std::vector<Leg> made;
  for (const Json& each : whole["legs"].items) {
    made.push_back(leg_of(each));
  }
  return made;
}

}  // namespace symkin::declared::reference
