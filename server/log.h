// The server's log: one line per event, on standard error.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <variant>

namespace stance {

enum class LogLevel { kDebug, kInfo, kWarn, kError };

using LogValue = std::variant<std::string, int64_t, double>;
using LogFields = std::initializer_list<std::pair<const char*, LogValue>>;

// Chooses format ("json" or "text") and level ("debug", "info", "warn", "error"). To be called once, before
// the first line.
void SetUpLog(const std::string& format, const std::string& level);

// Writes one line: time, level, event and fields; as a JSON object, or as `event key=value ...`. Thread-safe.
void Log(LogLevel level, const std::string& event, LogFields fields = {});

}  // namespace stance
