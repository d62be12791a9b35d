#pragma once

#include <string>
#include <vector>

namespace peat {
/// Without blanks and tabs at the ends.
std::string trim(const std::string &text);

/// 'text' for a message: at most 60 characters of it, unprintable bytes replaced.
std::string in_quotes(const std::string &text);
/// "'a', 'b', 'c'"
std::string in_quotes(const std::vector<std::string> &words);

/// At most `length` bytes on one line; "..." stands for what is left out.
std::string shortened(const std::string &text, std::size_t length);

/// "a, b, c"
std::string join(const std::vector<std::string> &words);

bool is_one_of(const std::vector<std::string> &words, const std::string &word);

/// The shortest text that reads back as exactly this number: 1e7, 0.25, -3.
std::string to_text(double number);
/// The numbers separated by commas.
std::string to_text(const std::vector<double> &numbers);

/// The candidate that someone who wrote `word` may have meant (few typing errors, upper and lower case
/// alike); "" if none is near.
std::string nearest(const std::string &word, const std::vector<std::string> &candidates);
/// The end of a message about a wrong word: "; did you mean 'X'?", or "" if nothing is near.
std::string did_you_mean(const std::string &word, const std::vector<std::string> &candidates);
/// The same, or "; known are 'X', 'Y'" if nothing is near.
std::string suggestion(const std::string &word, const std::vector<std::string> &candidates);
} // namespace peat
