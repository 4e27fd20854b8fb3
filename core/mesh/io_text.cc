#include "core/mesh/io_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace stance {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";
constexpr size_t kLongestQuote = 40;
constexpr size_t kLongestName = 255;

// std::from_chars takes no plus sign.
std::string_view WithoutPlus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
  return word;
}

// Bytes of the valid UTF-8 character at the front of `text` (RFC 3629, table 3-7 of Unicode), 0 if none.
size_t Utf8Length(std::string_view text) {
  const auto byte = [&](size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  const auto continues = [&](size_t k) { return (byte(k) & 0xC0u) == 0x80u; };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return continues(1) ? 2 : 0;
  if (lead >= 0xE0 && lead <= 0xEF) {
    if (lead == 0xE0 && byte(1) < 0xA0) return 0;  // overlong
    if (lead == 0xED && byte(1) > 0x9F) return 0;  // surrogates
    return continues(1) && continues(2) ? 3 : 0;
  }
  if (lead >= 0xF0 && lead <= 0xF4) {
    if (lead == 0xF0 && byte(1) < 0x90) return 0;  // overlong
    if (lead == 0xF4 && byte(1) > 0x8F) return 0;  // beyond U+10FFFF
    return continues(1) && continues(2) && continues(3) ? 4 : 0;
  }
  return 0;
}

}  // namespace

bool LineScanner::Next() {
  if (rest_.empty()) return false;
  const size_t end = rest_.find_first_of("\r\n");
  line_ = rest_.substr(0, end);
  if (end == std::string_view::npos) {
    rest_ = {};
  } else {
    const bool two = rest_[end] == '\r' && end + 1 < rest_.size() && rest_[end + 1] == '\n';
    rest_.remove_prefix(end + (two ? 2 : 1));
  }
  ++number_;
  return true;
}

std::string_view NextWord(std::string_view& text) {
  const size_t begin = std::min(text.find_first_not_of(kBlanks), text.size());
  const size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

std::string_view Trimmed(std::string_view text) {
  const size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::optional<float> ParseReal(std::string_view word) {
  word = WithoutPlus(word);
  float value = 0;
  const char* const end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  if (result.ptr != end || result.ec == std::errc::invalid_argument) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    // Too large or too small for a float: a double tells which; beyond that, the way it is written does.
    double wide = 0;
    bool small = false;
    if (std::from_chars(word.data(), end, wide).ec == std::errc()) {
      small = std::abs(wide) < 1;
    } else if (const size_t e = word.find_first_of("eE"); e != std::string_view::npos) {
      small = word[e + 1] == '-';
    } else {
      small = word.find_first_not_of("-0") == word.find('.');
    }
    value = small ? 0.0f : std::numeric_limits<float>::infinity();
    if (word[0] == '-') value = -value;
  }
  return value;
}

std::optional<int64_t> ParseInteger(std::string_view word) {
  word = WithoutPlus(word);
  int64_t value = 0;
  const char* const end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  if (result.ptr != end || result.ec != std::errc()) return std::nullopt;
  return value;
}

std::string Quoted(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text.substr(0, kLongestQuote)) quoted += c >= ' ' && c <= '~' ? c : '?';
  quoted += text.size() > kLongestQuote ? "...'" : "'";
  return quoted;
}

std::string CleanName(std::string_view name) {
  std::string clean;
  while (!name.empty()) {
    const size_t length = Utf8Length(name);
    if (clean.size() + std::max<size_t>(length, 1) > kLongestName) break;
    const bool control = static_cast<unsigned char>(name[0]) < 0x20 || name[0] == 0x7F;
    if (length == 0 || control) {
      clean += '?';
    } else {
      clean += name.substr(0, length);
    }
    name.remove_prefix(std::max<size_t>(length, 1));
  }
  return clean;
}

}  // namespace stance
