// Lines, words and numbers of the text formats, free of locale and safe on any bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace stance {

// Splits bytes into lines at \n, \r\n or \r. The views stay valid as long as the bytes.
class LineScanner {
 public:
  explicit LineScanner(std::string_view bytes) : rest_(bytes) {}

  // Moves to the next line (without its end); false after the last one.
  bool Next();
  std::string_view line() const { return line_; }
  int64_t number() const { return number_; }       // of the current line, from 1
  std::string_view rest() const { return rest_; }  // the bytes after the current line

 private:
  std::string_view rest_;
  std::string_view line_;
  int64_t number_ = 0;
};

// The next word of `text` (separated by blanks, tabs and line ends), removed from its front; empty at the
// end.
std::string_view NextWord(std::string_view& text);

// `text` without blanks, tabs and line ends at both sides.
std::string_view Trimmed(std::string_view text);

// `text` in lower case (ASCII).
std::string LowerCase(std::string_view text);

// The whole word as a number, or nothing. Reals are rounded to the nearest float; beyond its range they
// become infinite (CheckMesh refuses them), below it zero.
std::optional<float> ParseReal(std::string_view word);
std::optional<int64_t> ParseInteger(std::string_view word);

// The text in quotes for a message: at most 40 bytes of it, whatever is not printable ASCII replaced by '?'.
std::string Quoted(std::string_view text);

// A name from a file as valid UTF-8 of at most 255 bytes: every byte that is not part of valid UTF-8, and
// every control character, replaced by '?'.
std::string CleanName(std::string_view name);

}  // namespace stance
