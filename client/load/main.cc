// The load generator `stance-load`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include "client/cli/arguments.h"
#include "client/cli/credentials.h"
#include "client/cli/exit_code.h"
#include "client/cli/input.h"
#include "client/load/load_runner.h"
#include "client/request.h"

namespace stance {
namespace {

struct Arguments {
  std::string source, reference, model, method;
  TransferOptions options;
  ClientOptions client;
  CredentialArguments credentials;
  LoadOptions load;
  int64_t clients = 1;
  int64_t open_in_flight = 10000;
  double timeout = 30;
  bool json = false;
};

absl::Status Usage(const std::string& text) { return UsageError(absl::InvalidArgumentError(text)); }

absl::Status Check(const CLI::App& app, Arguments* arguments) {
  LoadPlanOptions& plan = arguments->load.plan;
  if (!(plan.rate >= 0) || !(plan.rate <= 1e6)) {
    return Usage(fmt::format("--rate: {:g} is not in [0, 1e6]", plan.rate));
  }
  if (arguments->clients < 1) return Usage(fmt::format("--clients: {} is not positive", arguments->clients));
  if (arguments->open_in_flight < 1) {
    return Usage(fmt::format("--max-in-flight: {} is not positive", arguments->open_in_flight));
  }
  if (!(plan.duration >= 0)) return Usage(fmt::format("--duration: {:g} is negative", plan.duration));
  if (plan.requests < 0) return Usage(fmt::format("--requests: {} is negative", plan.requests));
  if (arguments->load.warmup < 0)
    return Usage(fmt::format("--warmup: {} is negative", arguments->load.warmup));
  if (!(arguments->timeout > 0) || !(arguments->timeout <= 86400)) {
    return Usage(fmt::format("--timeout: {:g} is not in (0, 86400]", arguments->timeout));
  }
  if (!arguments->method.empty()) {
    const absl::StatusOr<Method> method = MethodFromName(arguments->method);
    if (!method.ok()) return Usage(fmt::format("--method: {}", std::string(method.status().message())));
    arguments->options.method = *method;
  }
  if (app.count("--duration") == 0 && plan.requests == 0) plan.duration = 10;
  if (plan.duration == 0 && plan.requests == 0) return Usage("--duration: 0 needs --requests");
  plan.max_in_flight = plan.rate > 0 ? arguments->open_in_flight : arguments->clients;
  arguments->load.timeout = std::chrono::duration<double>(arguments->timeout);
  arguments->client.connect_timeout = std::min(std::chrono::duration<double>(5.0), arguments->load.timeout);
  // A retry would hide from the report what the server answered.
  arguments->client.max_attempts = 1;
  return absl::OkStatus();
}

absl::Status Measure(const Arguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh source, ReadInput(arguments.source));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh reference, ReadInput(arguments.reference));
  CallOptions call;
  call.model = arguments.model;
  call.want_weights = false;
  const v1::TransferRequest request = MakeTransferRequest(source, reference, arguments.options, call);
  const absl::StatusOr<LoadReport> report = RunLoad(arguments.client, request, arguments.load);
  if (!report.ok()) {
    return NameFile(ServerError(report.status()),
                    {{"source", arguments.source}, {"reference", arguments.reference}});
  }
  std::fputs((arguments.json ? LoadReportJson(*report) : LoadReportText(*report)).c_str(), stdout);
  if (report->succeeded() == 0) return absl::UnavailableError("no request succeeded");
  return absl::OkStatus();
}

absl::Status Run(int argc, char** argv) {
  CLI::App app("Measures a stance-server under load: latency counts from each request's planned time.",
               "stance-load");
  Arguments arguments;
  LoadPlanOptions& plan = arguments.load.plan;
  arguments.client.server = DefaultServer();
  app.set_version_flag("--version", "stance-load " STANCE_VERSION);
  app.add_option("SOURCE", arguments.source, "Source mesh of every request")->required();
  app.add_option("REFERENCE", arguments.reference, "Reference mesh of every request")->required();
  app.add_option("--server", arguments.client.server, "The server; default $STANCE_SERVER or localhost:50051")
      ->type_name("HOST:PORT");
  AddCredentials(&app, &arguments.credentials);
  CLI::Option* rate = app.add_option("--rate", plan.rate, "Open loop: Poisson arrivals per second");
  app.add_option("--clients", arguments.clients, "Closed loop: clients that wait for each answer; default 1")
      ->excludes(rate);
  app.add_option("--duration", plan.duration, "Seconds of planned sending; default 10 without --requests");
  app.add_option("--requests", plan.requests, "Most requests; default: no limit");
  app.add_option("--max-in-flight", arguments.open_in_flight, "Open loop: most requests unanswered")
      ->needs(rate)
      ->capture_default_str();
  app.add_option("--warmup", arguments.load.warmup, "Requests before the measurement")->capture_default_str();
  app.add_option("--timeout", arguments.timeout, "Deadline of each request, seconds")->capture_default_str();
  app.add_option("--seed", plan.seed, "Of the arrival times")->capture_default_str();
  app.add_option("--model", arguments.model, "The model's name; default: the server's");
  app.add_option("--method", arguments.method, "stance, skeletal or neural; default: the server's");
  app.add_flag("--json", arguments.json, "The report as JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return absl::OkStatus();
  } catch (const CLI::CallForVersion& version) {
    std::fputs(fmt::format("{}\n", version.what()).c_str(), stdout);
    return absl::OkStatus();
  } catch (const CLI::Error& error) {
    return Usage(error.what());
  }
  STANCE_RETURN_IF_ERROR(Check(app, &arguments));
  STANCE_RETURN_IF_ERROR(ReadCredentials(arguments.credentials, &arguments.client));
  return Measure(arguments);
}

}  // namespace
}  // namespace stance

int main(int argc, char** argv) {
  absl::Status status;
  try {
    status = stance::Run(argc, argv);
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  if (!status.ok()) std::fputs(stance::ErrorLine("stance-load", status).c_str(), stderr);
  return static_cast<int>(stance::ExitCodeFor(status));
}
