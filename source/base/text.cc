#include <peat/base/text.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace peat {
namespace {
std::string lower_case(std::string text)
{
  for (char &c : text)
    c = std::tolower(static_cast<unsigned char>(c));
  return text;
}

/// Number of letters to insert, remove, replace, or swap with their neighbour to get from one word to the
/// other.
std::size_t edit_distance(const std::string &a, const std::string &b)
{
  std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before_last = last;
    last = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
  }
  return row[b.size()];
}
} // namespace

std::string trim(const std::string &text)
{
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos)
    return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::string shortened(const std::string &text, const std::size_t length)
{
  std::size_t end = std::min(text.size(), length);
  if (end < text.size()) {
    // Not in the middle of a UTF-8 character.
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80)
      --end;
  }
  std::string result = text.substr(0, end) + (end < text.size() ? "..." : "");
  for (char &c : result)
    if (std::iscntrl(static_cast<unsigned char>(c)))
      c = '?';
  return result;
}

std::string in_quotes(const std::string &text)
{
  return "'" + shortened(text, 60) + "'";
}

std::string in_quotes(const std::vector<std::string> &words)
{
  std::vector<std::string> result;
  for (const std::string &word : words)
    result.push_back(in_quotes(word));
  return join(result);
}

std::string join(const std::vector<std::string> &words)
{
  std::string result;
  for (std::size_t i = 0; i < words.size(); ++i)
    result += (i > 0 ? ", " : "") + words[i];
  return result;
}

bool is_one_of(const std::vector<std::string> &words, const std::string &word)
{
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string to_text(const double number)
{
  char buffer[64];
  const std::string text(buffer, std::to_chars(buffer, buffer + sizeof(buffer), number).ptr);
  const std::size_t exponent = text.find('e');
  if (exponent == std::string::npos || text.size() < exponent + 3)
    return text;
  // People write 1e7, the library 1e+07.
  const std::string sign = text[exponent + 1] == '-' ? "-" : "";
  const std::size_t digits = std::min(text.find_first_not_of('0', exponent + 2), text.size() - 1);
  return text.substr(0, exponent + 1) + sign + text.substr(digits);
}

std::string to_text(const std::vector<double> &numbers)
{
  std::vector<std::string> words;
  for (const double number : numbers)
    words.push_back(to_text(number));
  return join(words);
}

std::string nearest(const std::string &word, const std::vector<std::string> &candidates)
{
  std::string best;
  std::size_t best_distance = 0;
  for (const std::string &candidate : candidates) {
    const std::size_t shorter = std::min(word.size(), candidate.size());
    const std::size_t longer = std::max(word.size(), candidate.size());
    // A third of the letters may be wrong, at least one; but a single letter is not like any other letter.
    const std::size_t allowed = shorter < 2 ? 0 : std::max<std::size_t>(1, shorter / 3);
    if (longer - shorter > allowed)
      continue;
    const std::size_t distance = edit_distance(lower_case(word), lower_case(candidate));
    if (distance <= allowed && (best.empty() || distance < best_distance)) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string did_you_mean(const std::string &word, const std::vector<std::string> &candidates)
{
  const std::string best = nearest(word, candidates);
  return best.empty() ? "" : "; did you mean " + in_quotes(best) + "?";
}

std::string suggestion(const std::string &word, const std::vector<std::string> &candidates)
{
  const std::string near = did_you_mean(word, candidates);
  return near.empty() && !candidates.empty() ? "; known are " + in_quotes(candidates) : near;
}
} // namespace peat
