#include "core/training/evaluation_curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "core/base/check.h"
#include "core/base/random.h"
#include "core/base/threads.h"
#include "core/training/evaluation_disturbances.h"
#include "core/training/evaluation_pairs.h"

namespace stance {
namespace {

// Half the step between neighbouring vertex counts, which is a factor of two or a little more.
constexpr double kOwnCount = std::numbers::sqrt2;

}  // namespace

const std::vector<Curve>& AllCurves() {
  static const std::vector<Curve> kCurves = {
      {.disturbance = Disturbance::kVertices,
       .name = "vertices",
       .unit = "vertices",
       .levels = {500, 1000, 2000, 5000, 10'000, 20'000, 50'000, 100'000, 200'000},
       .logarithmic = true},
      {.disturbance = Disturbance::kNoise,
       .name = "noise",
       .unit = "% of the stature",
       .levels = {0, 0.25, 0.5, 1, 2}},
      {.disturbance = Disturbance::kHoles,
       .name = "holes",
       .unit = "% of the area",
       .levels = {0, 5, 10, 20, 30}},
      {.disturbance = Disturbance::kTilt, .name = "tilt", .unit = "degrees", .levels = {0, 30, 60, 90, 180}},
  };
  return kCurves;
}

TransferPair DisturbedPair(const TransferPair& pair, Disturbance disturbance, double level, uint64_t seed) {
  Random random(seed, static_cast<uint64_t>(disturbance));
  switch (disturbance) {
    case Disturbance::kVertices:
      return Remeshed(pair, static_cast<int64_t>(level), kOwnCount);
    case Disturbance::kNoise:
      return WithNoise(pair, level / 100, random);
    case Disturbance::kHoles:
      return WithHoles(pair, level / 100, random);
    case Disturbance::kTilt:
      return Tilted(pair, level * std::numbers::pi / 180, random);
  }
  STANCE_CHECK(false);
}

std::vector<CurveRow> EvaluateCurves(const CharacterGenerator& generator, const Pipeline& pipeline,
                                     const CurveEvaluationOptions& options,
                                     const std::function<void(int)>& progress) {
  struct Item {
    const Curve* curve;
    double level;
    int64_t index;
  };
  std::vector<Item> items;
  for (const Curve& curve : options.curves) {
    for (const double level : curve.levels) {
      for (int64_t index = 0; index < options.pairs; ++index) items.push_back({&curve, level, index});
    }
  }
  const Method method = options.transfer.method.value_or(pipeline.models().front().method);
  std::vector<CurveRow> rows(items.size());
  std::mutex mutex;
  int done = 0;  // protected by mutex
  const auto evaluate = [&](const Item& item, CurveRow& row) {
    const TransferPair pair = DisturbedPair(generator.MakePair(options.seed, item.index, options.characters),
                                            item.curve->disturbance, item.level,
                                            Random(options.seed, static_cast<uint64_t>(item.index)).Next());
    const Candidate candidate =
        MethodCandidate(method, pipeline.Transfer(pair.source.mesh, pair.reference.mesh, options.transfer));
    row = {.curve = item.curve->name,
           .level = item.level,
           .vertices = pair.source.mesh.vertex_count(),
           .row = Judge(fmt::format("{}-{}", PoseMixName(options.characters.poses), item.index), candidate,
                        pair.truth, pair.source.mesh.faces, pair.source.stature)};
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done);
  };
  ParallelFor(std::ssize(items), options.threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) evaluate(items[i], rows[i]);
  });
  return rows;
}

std::vector<CurvePoint> CurvePoints(const Curve& curve, const std::vector<CurveRow>& rows) {
  std::vector<CurvePoint> points;
  for (const double level : curve.levels) {
    CurvePoint point{.level = level};
    for (const CurveRow& one : rows) {
      if (one.curve != curve.name || one.level != level) continue;
      if (!one.row.failure.empty()) {
        ++point.failures;
        continue;
      }
      ++point.pairs;
      point.vertices += static_cast<double>(one.vertices);
      point.mean_mm += one.row.errors.mean_mm;
      point.p95_mm += one.row.p95_mm;
      point.worst_mm = std::max(point.worst_mm, one.row.errors.mean_mm);
      point.pmd += one.row.errors.pmd;
      point.elr += one.row.errors.elr;
    }
    if (point.pairs > 0) {
      for (double* sum : {&point.vertices, &point.mean_mm, &point.p95_mm, &point.pmd, &point.elr}) {
        *sum /= point.pairs;
      }
    }
    points.push_back(point);
  }
  return points;
}

std::string CurvesMarkdown(const std::vector<Curve>& curves, const std::vector<CurveRow>& rows) {
  std::string table =
      "| curve | level | pairs | vertices | mean mm | p95 mm | worst mm | PMD 1e-4 m^2 | ELR |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const Curve& curve : curves) {
    for (const CurvePoint& point : CurvePoints(curve, rows)) {
      table += fmt::format("| {} | {:.6g} {} | {}", curve.name, point.level, curve.unit, point.pairs);
      if (point.failures > 0) table += fmt::format(" (+{} failed)", point.failures);
      if (point.pairs == 0) {
        table += " | | | | | | |\n";
        continue;
      }
      table += fmt::format(" | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} | {:.3f} |\n", point.vertices,
                           point.mean_mm, point.p95_mm, point.worst_mm, point.pmd * 1e4, point.elr);
    }
  }
  return table;
}

std::string CurvesCsv(const std::vector<CurveRow>& rows) {
  std::string csv = "curve,level,pair,vertices,mean_mm,pmd_m2,p95_mm,elr,failure\n";
  for (const CurveRow& one : rows) {
    csv +=
        fmt::format("{},{:.6g},{},{},", CsvField(one.curve), one.level, CsvField(one.row.pair), one.vertices);
    if (one.row.failure.empty()) {
      csv += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},\n", one.row.errors.mean_mm, one.row.errors.pmd,
                         one.row.p95_mm, one.row.errors.elr);
    } else {
      csv += fmt::format(",,,,{}\n", CsvField(one.row.failure));
    }
  }
  return csv;
}

}  // namespace stance
