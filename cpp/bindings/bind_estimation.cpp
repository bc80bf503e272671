// SPDX-License-Identifier: MIT
#include <pybind11/numpy.h>

#include <cmath>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "bindings.hpp"
#include "symkin/estimation/accuracy.hpp"
#include "symkin/estimation/diagnosis.hpp"
#include "symkin/estimation/evaluation.hpp"
#include "symkin/estimation/fleet.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/estimation/observed_rows.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/estimation/starting_point.hpp"
#include "symkin/support/error.hpp"

namespace {

void bind_observability(py::module_& module) {
  using symkin::AccuracyWeights;
  using symkin::MeasurementNoise;
  using symkin::Observability;
  using symkin::RowKind;
  using symkin::Tolerances;

  py::class_<MeasurementNoise>(module, "MeasurementNoise")
      .def(py::init([](double position, double orientation, double reading) {
             const MeasurementNoise noise{position, orientation, reading};
             noise.check();
             return noise;
           }),
           py::arg("position"), py::arg("orientation"), py::arg("reading"));
  py::class_<Tolerances>(module, "Tolerances")
      .def(py::init([](double length, double angle, double gain) {
             const Tolerances tolerances{length, angle, gain};
             tolerances.check();
             return tolerances;
           }),
           py::arg("length"), py::arg("angle"), py::arg("gain"))
      .def(
          "deviations",
          [](const Tolerances& self, const symkin::Mechanism& mechanism, symkin::Index leg) {
            return self.deviations(mechanism, leg);
          },
          py::arg("mechanism"), py::arg("leg"));

  py::native_enum<RowKind>(module, "RowKind", "enum.Enum")
      .value("paper", RowKind::paper)
      .value("noise_aware", RowKind::noise_aware)
      .finalize();
  module.def("observability_rows", &symkin::observability_rows, py::arg("mechanism"),
             py::arg("leg"), py::arg("poses"), py::arg("kind"), py::arg("noise"), ReleaseGil());
  module.def("mechanism_rows", &symkin::mechanism_rows, py::arg("mechanism"), py::arg("poses"),
             py::arg("kind"), py::arg("noise"), ReleaseGil());
  py::class_<Observability>(module, "Observability")
      .def_readonly("r_diagonal", &Observability::r_diagonal)
      .def_readonly("indices", &Observability::indices)
      .def_readonly("singular_values", &Observability::singular_values)
      .def_readonly("condition", &Observability::condition)
      .def_readonly("rank", &Observability::rank)
      .def_readonly("null_directions", &Observability::null_directions);
  module.def("analyse_observability", &symkin::analyse_observability, py::arg("rows"),
             py::arg("scale"), ReleaseGil());

  py::class_<AccuracyWeights>(module, "AccuracyWeights")
      .def_readonly("position", &AccuracyWeights::position)
      .def_readonly("orientation", &AccuracyWeights::orientation)
      .def_readonly("evaluated", &AccuracyWeights::evaluated)
      .def_readonly("failed", &AccuracyWeights::failed);
  module.def("accuracy_weights", &symkin::accuracy_weights, py::arg("mechanism"), py::arg("poses"),
             ReleaseGil());
  module.def(
      "expected_accuracy",
      [](const AccuracyWeights& weights, symkin::ConstRows covariance) {
        const auto accuracy = symkin::expected_accuracy(weights, covariance);
        return std::make_pair(accuracy.position, accuracy.orientation);
      },
      py::arg("weights"), py::arg("covariance"));
}

using Rows = py::array_t<double, py::array::c_style>;
using Sets = py::array_t<symkin::Index, py::array::c_style>;
using Ties = std::vector<std::tuple<symkin::Index, symkin::Index, double>>;  // symkin::Tie

symkin::Layout layout_of(std::vector<symkin::Index> column, symkin::Vector prior, const Ties& ties,
                         symkin::RowMatrix relations = {}) {
  symkin::Layout layout{std::move(column), std::move(prior), {}, std::move(relations)};
  for (const auto& [scalar, moves_with, factor] : ties) {
    layout.ties.push_back({scalar, moves_with, factor});
  }
  return layout;
}

void check_shape(const symkin::MeasurementSet& set) {
  const auto rows = set.poses.rows();
  const auto sets = static_cast<symkin::Index>(set.leg_sets.size());
  if (set.readings.rows() != rows || sets != rows) {
    throw symkin::InvalidInput("readings have " + std::to_string(set.readings.rows()) +
                               " rows and leg_sets " + std::to_string(sets) + "; expected " +
                               std::to_string(rows) + ", one a pose");
  }
  const auto legs = set.readings.cols();
  for (const symkin::Index leg : set.leg_sets) {
    if (leg < -1 || leg >= legs) {
      throw symkin::InvalidInput("leg_sets has leg " + std::to_string(leg) + "; expected 0 to " +
                                 std::to_string(legs - 1) + ", or -1 for all");
    }
  }
}

void bind_simulation(py::module_& module) {
  using symkin::MeasurementSet;
  using symkin::PoseSet;
  using symkin::Simulation;

  py::class_<MeasurementSet>(module, "MeasurementSet")
      .def(py::init([](symkin::ConstRows poses, symkin::ConstRows readings, const Sets& leg_sets) {
             if (leg_sets.ndim() != 1) {
               throw symkin::InvalidInput("leg_sets have " + std::to_string(leg_sets.ndim()) +
                                          " dimensions; expected one");
             }
             MeasurementSet set{
                 poses, readings, {leg_sets.data(), leg_sets.data() + leg_sets.size()}};
             check_shape(set);
             return set;
           }),
           py::arg("poses"), py::arg("readings"), py::arg("leg_sets"))
      .def_readonly("poses", &MeasurementSet::poses)
      .def_readonly("readings", &MeasurementSet::readings)
      .def_property_readonly("leg_sets", [](const MeasurementSet& self) {
        return Sets(static_cast<symkin::Index>(self.leg_sets.size()), self.leg_sets.data());
      });
  py::class_<PoseSet>(module, "PoseSet")
      .def(py::init([](symkin::Index leg, symkin::RowMatrix poses, symkin::Index wanted,
                       symkin::Index together, symkin::RowMatrix readings) {
             return PoseSet{leg, std::move(poses), wanted, together, std::move(readings)};
           }),
           py::arg("leg"), py::arg("poses"), py::arg("wanted"), py::arg("together") = 1,
           py::arg("readings") = symkin::RowMatrix());
  py::class_<Simulation>(module, "Simulation")
      .def_readonly("measurements", &Simulation::measurements)
      .def_readonly("rows", &Simulation::rows)
      .def_readonly("replaced", &Simulation::replaced);
  module.def("disturb", &symkin::disturb, py::arg("nominal"), py::arg("tolerances"),
             py::arg("seed"));
  module.def("simulate", &symkin::simulate, py::arg("actual"), py::arg("model"), py::arg("sets"),
             py::arg("noise"), py::arg("seed"), ReleaseGil());
}

void bind_identification(py::module_& module) {
  using symkin::Estimator;
  using symkin::GoodnessOfFit;
  using symkin::Identification;
  using symkin::IdentificationOptions;
  using symkin::LegIdentification;
  using symkin::PoseUse;

  py::native_enum<Estimator>(module, "Estimator", "enum.Enum")
      .value("paper", Estimator::paper)
      .value("inverse", Estimator::inverse)
      .value("implicit", Estimator::implicit)
      .value("joint", Estimator::joint)
      .finalize();
  py::native_enum<PoseUse>(module, "PoseUse", "enum.Enum")
      .value("all", PoseUse::all)
      .value("own", PoseUse::own)
      .finalize();
  module.def("loss_names", &symkin::loss_names);
  module.def(
      "loss_bend",
      [](const std::string& name, symkin::Index conditions) {
        const symkin::RobustLoss loss = symkin::loss_named(name);
        return loss.any() ? symkin::bend_of(*loss.family, conditions) : 0.0;
      },
      py::arg("name"), py::arg("conditions"));

  py::class_<LegIdentification>(module, "LegIdentification")
      .def_readonly("rows", &LegIdentification::rows)
      .def_readonly("residuals", &LegIdentification::residuals)
      .def_readonly("standardised", &LegIdentification::standardised)
      .def_readonly("rejected", &LegIdentification::rejected)
      .def_readonly("converged", &LegIdentification::converged)
      .def_readonly("failure", &LegIdentification::failure)
      .def_readonly("iterations", &LegIdentification::iterations)
      .def_readonly("condition", &LegIdentification::condition)
      .def_readonly("student_degrees", &LegIdentification::student_degrees)
      .def_readonly("unguarded", &LegIdentification::unguarded);
  py::class_<GoodnessOfFit>(module, "GoodnessOfFit")
      .def_readonly("legs", &GoodnessOfFit::legs)
      .def_readonly("chi_square", &GoodnessOfFit::chi_square)
      .def_property_readonly("degrees_of_freedom",
                             [](const GoodnessOfFit& fit) -> std::variant<symkin::Index, double> {
                               // Closures less parameters are a whole number; what a loss makes of
                               // them is not.
                               if (fit.degrees_of_freedom == std::floor(fit.degrees_of_freedom)) {
                                 return static_cast<symkin::Index>(fit.degrees_of_freedom);
                               }
                               return fit.degrees_of_freedom;
                             })
      .def_readonly("limit", &GoodnessOfFit::limit)
      .def_readonly("least", &GoodnessOfFit::least);
  py::class_<Identification>(module, "Identification")
      .def_readonly("parameters", &Identification::parameters)
      .def_readonly("covariance", &Identification::covariance)
      .def_readonly("legs", &Identification::legs)
      .def_readonly("goodness", &Identification::goodness)
      .def_readonly("converged", &Identification::converged)
      .def_readonly("residual_rms", &Identification::residual_rms)
      .def_readonly("residual_max", &Identification::residual_max);
  module.def(
      "identify",
      [](const symkin::Mechanism& mechanism, const symkin::MeasurementSet& measurements,
         Estimator estimator, PoseUse use, const symkin::MeasurementNoise& noise,
         const std::string& loss, double loss_scale, int max_iterations) {
        const IdentificationOptions options{estimator, use, noise,
                                            symkin::loss_named(loss, loss_scale), max_iterations};
        return symkin::identify(mechanism, measurements, options);
      },
      py::arg("mechanism"), py::arg("measurements"), py::arg("estimator"), py::arg("use"),
      py::arg("noise"), py::arg("loss"), py::arg("loss_scale"), py::arg("max_iterations"),
      ReleaseGil());
}

void bind_joint(py::module_& module) {
  using symkin::Frame;
  using symkin::Gauge;
  using symkin::JointFit;
  using symkin::JointOptions;
  using symkin::LegCovariate;
  using symkin::Observations;
  using symkin::Observed;
  using symkin::ObservedRows;
  using symkin::RowFit;
  using symkin::Setup;

  py::class_<Frame>(module, "Frame")
      .def(py::init([](const symkin::Vector& position, const symkin::RowMatrix& rotation) {
             if (position.size() != 3 || rotation.rows() != 3 || rotation.cols() != 3) {
               throw symkin::InvalidInput("a frame is a position of 3 and a rotation of 3 x 3");
             }
             return Frame{position, rotation};
           }),
           py::arg("position"), py::arg("rotation"))
      .def_readonly("position", &Frame::position)
      .def_readonly("rotation", &Frame::rotation);
  py::class_<Setup>(module, "Setup")
      .def(
          py::init([](const symkin::Mechanism& mechanism, const symkin::RowMatrix& curvature,
                      const Frame& base, const Frame& target, const symkin::RowMatrix& points,
                      const symkin::RowMatrix& anchors, const symkin::Vector& plane,
                      const std::vector<std::pair<std::string, bool>>& leg_covariates,
                      const symkin::RowMatrix& leg_slopes, std::vector<std::string> base_covariates,
                      const symkin::RowMatrix& base_slopes, const symkin::Vector& zeros) {
            Setup setup = Setup::of(mechanism);
            if (curvature.rows() != setup.curvature.rows() || curvature.cols() != 3 ||
                points.cols() != 3 || anchors.cols() != 3 ||
                (plane.size() != 3 && (plane.size() != 5 || !(plane[4] > 0)))) {
              throw symkin::InvalidInput(
                  "expected the curvature as legs x 3, points and anchors as n x 3, the plane as "
                  "3, or with its bow and radius");
            }
            const auto fit = [](const symkin::RowMatrix& slopes, symkin::Index rows,
                                symkin::Index columns) {
              return slopes.size() == rows * columns &&
                     (slopes.size() == 0 || slopes.cols() == columns);
            };
            const auto of_legs = static_cast<symkin::Index>(leg_covariates.size());
            const auto of_base = static_cast<symkin::Index>(base_covariates.size());
            if (!fit(leg_slopes, mechanism.leg_count(), of_legs) || !fit(base_slopes, of_base, 6)) {
              throw symkin::InvalidInput(
                  "expected the slopes as legs x covariates of legs, and covariates of the base x "
                  "6");
            }
            for (const auto& [name, lengths] : leg_covariates) {
              setup.leg_covariates.push_back(
                  {name, lengths ? LegCovariate::Of::lengths : LegCovariate::Of::reading});
            }
            if (of_legs > 0) {
              setup.leg_slopes = leg_slopes;
            }
            setup.base_covariates = std::move(base_covariates);
            if (of_base > 0) {
              setup.base_slopes = base_slopes;
            }
            setup.curvature = curvature;
            setup.base = base;
            setup.target = target;
            setup.base_drawn = base.rotation;
            setup.target_drawn = target.rotation;
            setup.points = points;
            setup.anchors = anchors;
            setup.plane.head<3>() = plane.head<3>();
            if (plane.size() == 5) {
              setup.plane[3] = plane[3];
              setup.bed_radius = plane[4];
            }
            if (zeros.size() != 0 && zeros.size() != anchors.rows()) {
              throw symkin::InvalidInput("expected the zeros of distances as one an anchor");
            }
            setup.zeros = zeros.size() > 0 ? zeros : symkin::Vector::Zero(anchors.rows());
            return setup;
          }),
          py::arg("mechanism"), py::arg("curvature"), py::arg("base"), py::arg("target"),
          py::arg("points"), py::arg("anchors"), py::arg("plane"),
          py::arg("leg_covariates") = std::vector<std::pair<std::string, bool>>(),
          py::arg("leg_slopes") = symkin::RowMatrix(),
          py::arg("base_covariates") = std::vector<std::string>(),
          py::arg("base_slopes") = symkin::RowMatrix(), py::arg("zeros") = symkin::Vector())
      .def_readonly("parameters", &Setup::parameters)
      .def_readonly("curvature", &Setup::curvature)
      .def_readonly("base", &Setup::base)
      .def_readonly("target", &Setup::target)
      .def_readonly("points", &Setup::points)
      .def_readonly("anchors", &Setup::anchors)
      .def_readonly("plane", &Setup::plane)
      .def_readonly("zeros", &Setup::zeros)
      .def_readonly("bed_radius", &Setup::bed_radius)
      .def_property_readonly("leg_covariates",
                             [](const Setup& setup) {
                               std::vector<std::pair<std::string, bool>> covariates;
                               for (const LegCovariate& each : setup.leg_covariates) {
                                 covariates.emplace_back(each.name,
                                                         each.of == LegCovariate::Of::lengths);
                               }
                               return covariates;
                             })
      .def_readonly("leg_slopes", &Setup::leg_slopes)
      .def_readonly("base_covariates", &Setup::base_covariates)
      .def_readonly("base_slopes", &Setup::base_slopes)
      .def(
          "drawn_as",
          [](Setup setup, const Setup& other) {
            setup.base_drawn = other.base_drawn;
            setup.target_drawn = other.target_drawn;
            return setup;
          },
          py::arg("other"));
  module.def("unknown_names", &symkin::unknown_names, py::arg("mechanism"), py::arg("setup"));

  py::class_<Observed>(module, "Observed")
      .def(py::init(
               [](symkin::RowMatrix values, symkin::RowMatrix deviations, symkin::RowMatrix axes) {
                 return Observed{std::move(values), std::move(deviations), std::move(axes)};
               }),
           py::arg("values"), py::arg("deviations"), py::arg("axes") = symkin::RowMatrix())
      .def_readonly("values", &Observed::values)
      .def_readonly("deviations", &Observed::deviations);
  py::class_<Observations>(module, "Observations")
      .def(py::init([](Observed readings, Observed poses, Observed reported, Observed points,
                       Observed distances, Observed heights, Observed attitudes, Observed turns,
                       Observed separations, Observed rises, Observed offsets,
                       symkin::RowMatrix turn_axes, symkin::RowMatrix partners,
                       symkin::RowMatrix leg_covariates, symkin::RowMatrix base_covariates) {
             return Observations{
                 std::move(readings),  std::move(poses),          std::move(reported),
                 std::move(points),    std::move(distances),      std::move(heights),
                 std::move(attitudes), std::move(turns),          std::move(turn_axes),
                 std::move(partners),  std::move(separations),    std::move(rises),
                 std::move(offsets),   std::move(leg_covariates), std::move(base_covariates)};
           }),
           py::arg("readings"), py::arg("poses"), py::arg("reported"), py::arg("points"),
           py::arg("distances"), py::arg("heights"), py::arg_v("attitudes", Observed(), "..."),
           py::arg_v("turns", Observed(), "..."), py::arg_v("separations", Observed(), "..."),
           py::arg_v("rises", Observed(), "..."), py::arg_v("offsets", Observed(), "..."),
           py::arg("turn_axes") = symkin::RowMatrix(), py::arg("partners") = symkin::RowMatrix(),
           py::arg("leg_covariates") = symkin::RowMatrix(),
           py::arg("base_covariates") = symkin::RowMatrix());

  module.def("starting_poses", &symkin::starting_poses, py::arg("mechanism"), py::arg("setup"),
             py::arg("observations"), py::arg("home"), ReleaseGil());
  module.def("with_starting_frames", &symkin::with_starting_frames, py::arg("mechanism"),
             py::arg("setup"), py::arg("observations"), py::arg("home"), py::arg("base"),
             py::arg("target"), ReleaseGil());
  py::class_<ObservedRows>(module, "ObservedRows")
      .def_readonly("jacobian", &ObservedRows::jacobian)
      .def_readonly("residual", &ObservedRows::residual);
  module.def(
      "observed_rows",
      [](const symkin::Mechanism& mechanism, const Setup& setup, const Observations& observations,
         std::vector<symkin::Index> column, symkin::Vector prior, symkin::ConstRows poses,
         const Ties& ties) {
        const symkin::Layout layout = layout_of(std::move(column), std::move(prior), ties);
        return symkin::observed_rows(mechanism, setup, observations, layout, poses);
      },
      py::arg("mechanism"), py::arg("setup"), py::arg("observations"), py::arg("column"),
      py::arg("prior"), py::arg("poses"), py::arg("ties") = Ties(), ReleaseGil());

  py::class_<RowFit>(module, "RowFit")
      .def_readonly("pose", &RowFit::pose)
      .def_readonly("kind", &RowFit::kind)
      .def_readonly("index", &RowFit::index)
      .def_readonly("residual", &RowFit::residual)
      .def_readonly("t", &RowFit::t)
      .def_readonly("blunder", &RowFit::blunder);
  py::class_<JointFit>(module, "JointFit")
      .def_readonly("setup", &JointFit::setup)
      .def_readonly("change", &JointFit::change)
      .def_readonly("covariance", &JointFit::covariance)
      .def_readonly("model_covariance", &JointFit::model_covariance)
      .def_readonly("poses", &JointFit::poses)
      .def_readonly("reading_errors", &JointFit::reading_errors)
      .def_readonly("rows", &JointFit::rows)
      .def_readonly("conditions", &JointFit::conditions)
      .def_readonly("chi_squares", &JointFit::chi_squares)
      .def_readonly("loss_weights", &JointFit::loss_weights)
      .def_readonly("aside", &JointFit::aside)
      .def_readonly("chi_square_data", &JointFit::chi_square_data)
      .def_readonly("chi_square_prior", &JointFit::chi_square_prior)
      .def_readonly("goodness", &JointFit::goodness)
      .def_readonly("rank", &JointFit::rank)
      .def_readonly("data_rank", &JointFit::data_rank)
      .def_readonly("unseen", &JointFit::unseen)
      .def_readonly("gauge_directions", &JointFit::gauge_directions)
      .def_readonly("converged", &JointFit::converged)
      .def_readonly("failure", &JointFit::failure)
      .def_readonly("iterations", &JointFit::iterations)
      .def_readonly("student_degrees", &JointFit::student_degrees)
      .def_readonly("unguarded", &JointFit::unguarded);
  module.def(
      "fit_jointly",
      [](const symkin::Mechanism& mechanism, const Setup& setup, const Observations& observations,
         std::vector<symkin::Index> column, symkin::Vector prior, const std::string& loss,
         double loss_scale, double loss_spread, int max_iterations, bool nearest,
         symkin::Vector tolerances, symkin::RowMatrix start, bool rows, const Ties& ties,
         symkin::RowMatrix relations) {
        const symkin::Layout layout =
            layout_of(std::move(column), std::move(prior), ties, std::move(relations));
        symkin::RobustLoss robust = symkin::loss_named(loss, loss_scale);
        robust.spread = loss_spread;
        const JointOptions options{robust,
                                   max_iterations,
                                   nearest ? Gauge::nominal : Gauge::refuse,
                                   std::move(tolerances),
                                   std::move(start),
                                   rows};
        return symkin::fit_jointly(mechanism, setup, observations, layout, options);
      },
      py::arg("mechanism"), py::arg("setup"), py::arg("observations"), py::arg("column"),
      py::arg("prior"), py::arg("loss"), py::arg("loss_scale"), py::arg("loss_spread"),
      py::arg("max_iterations"), py::arg("nearest"), py::arg("tolerances"), py::arg("start"),
      py::arg("rows") = true, py::arg("ties") = Ties(), py::arg("relations") = symkin::RowMatrix(),
      ReleaseGil());
  module.def("left_unexplained", &symkin::left_unexplained, py::arg("mechanism"), py::arg("setup"),
             py::arg("observations"), py::arg("poses"), py::arg("pose"), ReleaseGil());
}

// Of all robots, whose arrays outlive it.
std::vector<symkin::MeasuredRobot> measured_robots(const symkin::Mechanism& mechanism,
                                                   const std::vector<Rows>& poses,
                                                   const std::vector<Rows>& readings,
                                                   const std::vector<Sets>& leg_sets) {
  if (readings.size() != poses.size() || leg_sets.size() != poses.size()) {
    throw symkin::InvalidInput("there are poses of " + std::to_string(poses.size()) +
                               " robots, readings of " + std::to_string(readings.size()) +
                               " and leg_sets of " + std::to_string(leg_sets.size()));
  }
  const symkin::Index coordinates = symkin::coordinate_count(mechanism.pose_space());
  const symkin::Index legs = mechanism.leg_count();
  std::vector<symkin::MeasuredRobot> robots;
  robots.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const symkin::Index count = leg_sets[i].size();
    const auto fits = [&](const Rows& rows, symkin::Index columns) {
      return rows.ndim() == 2 && rows.shape(0) == count && rows.shape(1) == columns;
    };
    if (leg_sets[i].ndim() != 1 || !fits(poses[i], coordinates) || !fits(readings[i], legs)) {
      throw symkin::InvalidInput("robot " + std::to_string(i + 1) +
                                 " has arrays of other shapes; expected poses N x " +
                                 std::to_string(coordinates) + ", readings N x " +
                                 std::to_string(legs) + " and leg_sets N");
    }
    robots.push_back({count, poses[i].data(), readings[i].data(), leg_sets[i].data()});
  }
  return robots;
}

void bind_fleet(py::module_& module) {
  using symkin::Fleet;

  py::class_<Fleet>(module, "Fleet")
      .def_readonly("parameters", &Fleet::parameters)
      .def_readonly("deviations", &Fleet::deviations)
      .def_readonly("chi_square", &Fleet::chi_square)
      .def_readonly("degrees_of_freedom", &Fleet::degrees_of_freedom)
      .def_readonly("limit", &Fleet::limit)
      .def_readonly("least", &Fleet::least)
      .def_readonly("residual_rms", &Fleet::residual_rms)
      .def_readonly("rejected", &Fleet::rejected)
      .def_readonly("student_degrees", &Fleet::student_degrees)
      .def_readonly("failures", &Fleet::failures);
  module.def(
      "identify_many",
      [](const symkin::Mechanism& mechanism, const std::vector<Rows>& poses,
         const std::vector<Rows>& readings, const std::vector<Sets>& leg_sets,
         symkin::Estimator estimator, symkin::PoseUse use, const symkin::MeasurementNoise& noise,
         const std::string& loss, double loss_scale, int max_iterations, int threads) {
        const symkin::IdentificationOptions options{
            estimator, use, noise, symkin::loss_named(loss, loss_scale), max_iterations};
        const auto robots = measured_robots(mechanism, poses, readings, leg_sets);
        const py::gil_scoped_release released;
        return symkin::identify_many(mechanism, robots, options, threads);
      },
      py::arg("mechanism"), py::arg("poses"), py::arg("readings"), py::arg("leg_sets"),
      py::arg("estimator"), py::arg("use"), py::arg("noise"), py::arg("loss"),
      py::arg("loss_scale"), py::arg("max_iterations"), py::arg("threads"));
}

void bind_diagnosis(py::module_& module) {
  using symkin::Diagnosis;
  using symkin::ResidualTest;
  using symkin::Suspect;

  py::native_enum<Suspect>(module, "Suspect", "enum.Enum")
      .value("sensor_curvature", Suspect::sensor_curvature)
      .value("sensor_eccentricity", Suspect::sensor_eccentricity)
      .value("geometry", Suspect::geometry)
      .value("order", Suspect::order)
      .value("legs", Suspect::legs)
      .value("estimators", Suspect::estimators)
      .finalize();
  py::class_<ResidualTest>(module, "ResidualTest")
      .def_readonly("suspect", &ResidualTest::suspect)
      .def_readonly("leg", &ResidualTest::leg)
      .def_readonly("other", &ResidualTest::other)
      .def_readonly("statistic", &ResidualTest::statistic)
      .def_readonly("terms", &ResidualTest::terms)
      .def_readonly("spare", &ResidualTest::spare)
      .def_readonly("p_value", &ResidualTest::p_value)
      .def_readonly("size", &ResidualTest::size);
  py::class_<Diagnosis>(module, "Diagnosis")
      .def_readonly("tests", &Diagnosis::tests)
      .def_readonly("student", &Diagnosis::student)
      .def_readonly("student_p", &Diagnosis::student_p)
      .def_readonly("pose_p", &Diagnosis::pose_p)
      .def_readonly("chi_square", &Diagnosis::chi_square)
      .def_readonly("degrees_of_freedom", &Diagnosis::degrees_of_freedom);
  module.def("diagnose", &symkin::diagnose, py::arg("estimate"), py::arg("measurements"),
             py::arg("noise"), py::arg("rejected"), py::arg("turning_sensor"), py::arg("alarm"),
             ReleaseGil());
}

void bind_evaluation(py::module_& module) {
  using symkin::PoseErrors;
  py::class_<PoseErrors>(module, "PoseErrors")
      .def_readonly("differences", &PoseErrors::differences)
      .def_readonly("evaluated", &PoseErrors::evaluated)
      .def_readonly("failed", &PoseErrors::failed)
      .def_readonly("position_rms", &PoseErrors::position_rms)
      .def_readonly("position_max", &PoseErrors::position_max)
      .def_readonly("orientation_rms", &PoseErrors::orientation_rms)
      .def_readonly("orientation_max", &PoseErrors::orientation_max);
  module.def("command_errors", &symkin::command_errors, py::arg("actual"), py::arg("model"),
             py::arg("commanded"), ReleaseGil());
  module.def("measurement_errors", &symkin::measurement_errors, py::arg("model"),
             py::arg("measured"), py::arg("readings"), ReleaseGil());
}

}  // namespace

void bind_estimation(py::module_& module) {
  bind_observability(module);
  bind_simulation(module);
  bind_identification(module);
  bind_joint(module);
  bind_fleet(module);
  bind_diagnosis(module);
  bind_evaluation(module);
}
