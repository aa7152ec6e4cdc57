// Our sparse Cholesky factorisation compared with Eigen's and Ceres's on the normal equations of three real
// problems at their solutions: processor seconds of one step, and of the covariance of every pose, as a
// table.
//
// usage: solver_comparison            the recording needs WAYMARK_DATA
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/SparseCholesky>

#ifdef WAYMARK_HAVE_CERES
#include <ceres/ceres.h>
#include <ceres/covariance.h>
#endif

#include "tests/support/tag_scenes.hpp"
#include "waymark/app/scene/scene_recording.hpp"
#include "waymark/config/exchange/tagslam.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace {

using namespace waymark;
using waymark::internal::BlockSystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The minimum of several runs.
double least_s(int runs, const std::function<void()>& run) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < runs; ++i) {
    const double start = cpu_s();
    run();
    least = std::min(least, cpu_s() - start);
  }
  return least;
}

/// A linearised residual: its unknowns, and its Jacobian for each.
struct LinearTerm {
  std::vector<int> unknowns{};
  std::vector<Eigen::MatrixXd> J{};
  Eigen::VectorXd r{};
};

struct Problem {
  std::string name{};
  waymark::internal::Unknowns unknowns{};
  std::vector<LinearTerm> terms{};

  [[nodiscard]] BlockSystem system() const { return {unknowns.dimensions, unknowns.couplings}; }
  void fill(BlockSystem& system) const {
    system.clear();
    for (const LinearTerm& term : terms) {
      std::vector<BlockSystem::Part> parts;
      parts.reserve(term.unknowns.size());
      for (std::size_t i = 0; i < term.unknowns.size(); ++i) parts.push_back({term.unknowns[i], term.J[i]});
      system.add(parts, term.r);
    }
  }
};

/// The corners, priors and motions of a scene; every unknown has a weak prior, so that the solution is
/// unique.
Problem linearized(const std::string& name, const Bundle& bundle) {
  constexpr double kHold = 1e-3;
  Problem problem{.name = name, .unknowns = waymark::internal::unknowns_of(bundle)};
  const auto pose = [&](PoseIndex i) { return bundle.poses[i].value; };
  const auto add = [&](const Eigen::VectorXd& r,
                       const std::vector<std::pair<PoseIndex, Eigen::MatrixXd>>& parts) {
    LinearTerm term{.r = r};
    for (const auto& [index, J] : parts) {
      if (problem.unknowns.of_pose[index] < 0) continue;
      term.unknowns.push_back(problem.unknowns.of_pose[index]);
      term.J.push_back(J);
    }
    if (!term.J.empty()) problem.terms.push_back(std::move(term));
  };
  for (const CornerTerm& term : bundle.corners) {
    CornerJacobians J;
    const CornerPoses poses{pose(term.rig), pose(term.cam), pose(term.body), pose(term.tag)};
    const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses, &J);
    if (term.used && r)
      add(*r, {{term.rig, J.rig}, {term.cam, J.cam}, {term.body, J.body}, {term.tag, J.tag}});
  }
  for (const PriorTerm& term : bundle.priors) {
    Matrix6 J;
    const Vector6 r = pose_prior_residual(term.factor, pose(term.pose), &J);
    add(r, {{term.pose, J}});
  }
  for (const RelativeTerm& term : bundle.relatives) {
    if (!term.used) continue;
    Matrix6 J_a;
    Matrix6 J_b;
    const Vector6 r = relative_pose_residual(term.factor, pose(term.a), pose(term.b), &J_a, &J_b);
    add(r, {{term.a, J_a}, {term.b, J_b}});
  }
  for (std::size_t u = 0; u < problem.unknowns.dimensions.size(); ++u) {
    const int n = problem.unknowns.dimensions[u];
    problem.terms.push_back(
        {{static_cast<int>(u)}, {kHold * Eigen::MatrixXd::Identity(n, n)}, Eigen::VectorXd::Zero(n)});
  }
  return problem;
}

struct Times {
  double step_s = kNone, covariance_s = kNone;
};

Times of_fronts(const Problem& problem) {
  BlockSystem system = problem.system();
  problem.fill(system);
  const waymark::internal::FrontPlan plan = waymark::internal::front_plan(system);
  waymark::internal::FrontCholesky cholesky(system, plan);
  Times times;
  times.step_s = least_s(5, [&] {
    problem.fill(system);
    if (!cholesky.factorize(0, 0)) std::abort();
    (void)cholesky.solve(-system.gradient());
  });
  std::vector<std::pair<int, int>> diagonal;
  for (int u = 0; u < system.unknowns(); ++u) diagonal.emplace_back(u, u);
  times.covariance_s = least_s(3, [&] {
    if (!cholesky.factorize(0, 0)) std::abort();
    (void)cholesky.inverse_blocks(diagonal);
  });
  return times;
}

/// Eigen's has no selected inverse: the blocks are columns of the inverse, one solution per scalar; a sample
/// of the unknowns represents all.
Times of_eigen(const Problem& problem) {
  constexpr int kSample = 100;
  BlockSystem system = problem.system();
  problem.fill(system);
  Eigen::SimplicialLDLT<BlockSystem::Sparse, Eigen::Lower> ldlt;
  ldlt.analyzePattern(system.lower());
  Times times;
  times.step_s = least_s(5, [&] {
    problem.fill(system);
    ldlt.factorize(system.lower());
    if (ldlt.info() != Eigen::Success) std::abort();
    const Eigen::VectorXd step = ldlt.solve(-system.gradient());
  });
  const double factor_s = least_s(3, [&] { ldlt.factorize(system.lower()); });
  const int sample = std::min(kSample, system.unknowns());
  const double sample_s = least_s(1, [&] {
    for (int i = 0; i < sample; ++i) {
      const int u = static_cast<int>(static_cast<long>(system.unknowns()) * i / sample);
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system.gradient().size(), system.dimension(u));
      unit.middleRows(system.offset(u), system.dimension(u)).setIdentity();
      const Eigen::MatrixXd columns = ldlt.solve(unit);
    }
  });
  times.covariance_s = factor_s + sample_s * system.unknowns() / sample;
  return times;
}

#ifdef WAYMARK_HAVE_CERES
class LinearCost final : public ceres::CostFunction {
 public:
  explicit LinearCost(const LinearTerm& term) : term_(term) {
    set_num_residuals(static_cast<int>(term.r.size()));
    for (const Eigen::MatrixXd& J : term.J)
      mutable_parameter_block_sizes()->push_back(static_cast<int>(J.cols()));
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<Eigen::VectorXd> r(residuals, term_.r.size());
    r = term_.r;
    for (std::size_t i = 0; i < term_.J.size(); ++i) {
      const Eigen::MatrixXd& J = term_.J[i];
      r.noalias() += J * Eigen::Map<const Eigen::VectorXd>(x[i], J.cols());
      if (jacobians != nullptr && jacobians[i] != nullptr)
        Eigen::Map<RowMajor>(jacobians[i], J.rows(), J.cols()) = J;
    }
    return true;
  }

 private:
  const LinearTerm& term_;
};

/// Seconds of several damped steps including all preparation.
double ceres_steps_s(const Problem& problem, ceres::LinearSolverType solver, int steps) {
  return least_s(2, [&] {
    std::vector<std::array<double, 6>> x(problem.unknowns.dimensions.size());
    for (auto& block : x) block.fill(1);  // far from the solution, so that each step reduces the cost
    ceres::Problem linear;
    for (const LinearTerm& term : problem.terms) {
      std::vector<double*> blocks;
      for (int u : term.unknowns) blocks.push_back(x[static_cast<std::size_t>(u)].data());
      linear.AddResidualBlock(new LinearCost(term), nullptr, blocks);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = solver;
    options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
    options.num_threads = 1;
    options.max_num_iterations = steps;
    options.initial_trust_region_radius = options.max_trust_region_radius = 1;  // half of the distance
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &linear, &summary);
    if (static_cast<int>(summary.iterations.size()) != steps + 1)
      std::fprintf(stderr, "Ceres: %zu of %d steps: %s\n", summary.iterations.size(), steps + 1,
                   summary.message.c_str());
  });
}

Times of_ceres(const Problem& problem) {
  Times times;
  for (const auto solver : {ceres::SPARSE_NORMAL_CHOLESKY, ceres::SPARSE_SCHUR}) {
    constexpr int kSteps = 6;
    const double more_s = ceres_steps_s(problem, solver, 1 + kSteps) - ceres_steps_s(problem, solver, 1);
    times.step_s = std::fmin(times.step_s, more_s / kSteps);
  }
  std::vector<std::array<double, 6>> x(problem.unknowns.dimensions.size());
  ceres::Problem linear;
  for (const LinearTerm& term : problem.terms) {
    std::vector<double*> blocks;
    for (int u : term.unknowns) blocks.push_back(x[static_cast<std::size_t>(u)].data());
    linear.AddResidualBlock(new LinearCost(term), nullptr, blocks);
  }
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  std::vector<std::pair<const double*, const double*>> diagonal;
  diagonal.reserve(x.size());
  for (const auto& block : x) diagonal.emplace_back(block.data(), block.data());
  times.covariance_s = least_s(1, [&] {
    ceres::Covariance covariance(options);
    if (!covariance.Compute(diagonal, &linear)) std::fprintf(stderr, "Ceres: no covariance\n");
  });
  return times;
}
#else
Times of_ceres(const Problem& /*problem*/) { return {}; }
#endif

void print(const char* who, const Times& times, const Times& ours) {
  std::printf("  %-26s step %9.2f ms (%6.2f)   covariance %9.2f ms (%7.2f)\n", who, 1e3 * times.step_s,
              times.step_s / ours.step_s, 1e3 * times.covariance_s, times.covariance_s / ours.covariance_s);
  std::fflush(stdout);
}

void compare(const std::string& name, const TagScene& scene, const SceneRecording& recording) {
  const auto map = map_scene(scene, recording);
  if (!map) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), to_string(map.error()).c_str());
    return;
  }
  const Problem problem = linearized(name, map->problem.bundle);
  BlockSystem system = problem.system();
  std::printf("%s: %d unknowns, %zu terms, %ld numbers in the normal equations\n", name.c_str(),
              system.unknowns(), problem.terms.size(), static_cast<long>(system.lower().nonZeros()));
  const Times ours = of_fronts(problem);
  print("fronts (ours)", ours, ours);
  print("Eigen SimplicialLDLT", of_eigen(problem), ours);
  print("Ceres, SuiteSparse", of_ceres(problem), ours);
}

void compare_recording(const std::string& folder) {
  const Result<TagScene> scene = read_tagslam_folder(folder);
  std::vector<std::string> warnings;
  if (!scene) {
    std::fprintf(stderr, "%s\n", to_string(scene.error()).c_str());
    return;
  }
  const Result<SceneRecording> recording =
      read_scene_recording(folder + "/tag_detections.bag.bz2", *scene, {}, warnings);
  if (!recording) {
    std::fprintf(stderr, "%s\n", to_string(recording.error()).c_str());
    return;
  }
  compare("TagSLAM's test 10, a corridor", *scene, *recording);
}

}  // namespace

int main() {
  std::printf("In brackets: times as long as our fronts.\n");
  if (const char* data = std::getenv("WAYMARK_DATA"))
    compare_recording(std::string(data) + "/tagslam/test_10");
  else
    std::printf("WAYMARK_DATA is not set: no recording\n");
  const test::WideScene aisles = test::aisles(520, 1);
  compare("aisles of 520 tags", aisles.scene, aisles.recording);
  const test::WideScene ceiling = test::ceiling(500, 1);
  compare("a ceiling of 500 tags", ceiling.scene, ceiling.recording);
  return 0;
}
