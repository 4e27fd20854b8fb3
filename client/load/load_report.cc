#include "client/load/load_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace stance {
namespace {

int64_t Nanoseconds(double seconds) { return static_cast<int64_t>(std::llround(seconds * 1e9)); }
double Milliseconds(int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-6; }

nlohmann::ordered_json Summary(const LogHistogram& histogram) {
  return {{"mean", histogram.mean() * 1e-6},
          {"min", Milliseconds(histogram.min())},
          {"p50", Milliseconds(histogram.Quantile(0.50))},
          {"p90", Milliseconds(histogram.Quantile(0.90))},
          {"p99", Milliseconds(histogram.Quantile(0.99))},
          {"max", Milliseconds(histogram.max())}};
}

}  // namespace

void LoadReport::Record(double planned_time, double sent_time, double answered_time,
                        const std::string& code) {
  send_delay.Add(Nanoseconds(sent_time - planned_time));
  if (code == "OK") {
    latency.Add(Nanoseconds(answered_time - planned_time));
  } else {
    ++errors[code];
  }
}

double LoadReport::throughput() const {
  return seconds > 0 ? static_cast<double>(succeeded()) / seconds : 0.0;
}

std::string LoadReportText(const LoadReport& report) {
  std::string text;
  if (report.mode == "open") {
    text += fmt::format("open loop, {:g} requests/s planned\n", report.rate);
  } else {
    text += fmt::format("closed loop, {} clients\n", report.clients);
  }
  text += fmt::format("requests    {} planned, {} sent, {} unsent, {} ok\n", report.planned, report.sent,
                      report.unsent, report.succeeded());
  text += fmt::format("throughput  {:.2f} ok/s over {:.2f} s\n", report.throughput(), report.seconds);
  text += fmt::format("latency ms  p50 {:.2f}  p90 {:.2f}  p99 {:.2f}  max {:.2f}  mean {:.2f}\n",
                      Milliseconds(report.latency.Quantile(0.5)), Milliseconds(report.latency.Quantile(0.9)),
                      Milliseconds(report.latency.Quantile(0.99)), Milliseconds(report.latency.max()),
                      report.latency.mean() * 1e-6);
  text += fmt::format("send delay  p99 {:.2f} ms\n", Milliseconds(report.send_delay.Quantile(0.99)));
  for (const auto& [code, count] : report.errors) text += fmt::format("error       {}: {}\n", code, count);
  return text;
}

std::string LoadReportJson(const LoadReport& report) {
  nlohmann::ordered_json json = {{"mode", report.mode}};
  if (report.mode == "open") {
    json["rate"] = report.rate;
  } else {
    json["clients"] = report.clients;
  }
  json["seconds"] = report.seconds;
  json["planned"] = report.planned;
  json["sent"] = report.sent;
  json["unsent"] = report.unsent;
  json["ok"] = report.succeeded();
  json["throughput"] = report.throughput();
  json["latency_ms"] = Summary(report.latency);
  json["send_delay_ms"] = Summary(report.send_delay);
  json["errors"] = nlohmann::ordered_json::object();
  for (const auto& [code, count] : report.errors) json["errors"][code] = count;
  return json.dump(2) + "\n";
}

}  // namespace stance
