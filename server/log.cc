#include "server/log.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

namespace stance {
namespace {

bool json_lines = true;  // set before the first line, constant afterwards

spdlog::level::level_enum ToSpdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarn:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

std::string TextLine(const std::string& event, LogFields fields) {
  std::string line = event;
  for (const auto& [key, value] : fields) {
    if (const auto* text = std::get_if<std::string>(&value)) {
      const bool plain = !text->empty() && text->find_first_of(" \"=\n") == std::string::npos;
      line += fmt::format(" {}={}", key, plain ? *text : nlohmann::json(*text).dump());
    } else if (const auto* integer = std::get_if<int64_t>(&value)) {
      line += fmt::format(" {}={}", key, *integer);
    } else {
      line += fmt::format(" {}={:.6g}", key, std::get<double>(value));
    }
  }
  return line;
}

// The fields of a JSON object, without its braces: spdlog's pattern adds time and level.
std::string JsonFields(const std::string& event, LogFields fields) {
  nlohmann::ordered_json object;
  object["event"] = event;
  for (const auto& [key, value] : fields) {
    std::visit([&object, key = key](const auto& v) { object[key] = v; }, value);
  }
  const std::string text = object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  return text.substr(1, text.size() - 2);
}

}  // namespace

void SetUpLog(const std::string& format, const std::string& level) {
  json_lines = format == "json";
  auto logger = spdlog::stderr_logger_mt("stance");
  logger->set_pattern(
      json_lines ? R"({"time":"%Y-%m-%dT%H:%M:%S.%fZ","level":"%l",%v})" : "%Y-%m-%dT%H:%M:%S.%eZ %l %v",
      spdlog::pattern_time_type::utc);
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

void Log(LogLevel level, const std::string& event, LogFields fields) {
  spdlog::logger* logger = spdlog::default_logger_raw();
  if (!logger->should_log(ToSpdlog(level))) return;
  logger->log(ToSpdlog(level),
              spdlog::string_view_t(json_lines ? JsonFields(event, fields) : TextLine(event, fields)));
}

}  // namespace stance
