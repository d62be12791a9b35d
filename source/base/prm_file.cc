#include <peat/base/prm_file.h>
#include <peat/base/text.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace peat {
namespace {
/// Bounds the recursion of those who walk through the sections.
constexpr unsigned int max_depth = 100;

const char *const what_a_line_is =
    "a line is 'set KEY = VALUE', 'subsection NAME', 'end', 'include FILE' or a comment '# ...'";

/// The item whose member `name` is the wanted one, or null.
template <class Items, class Name>
auto find(Items &items, const Name name, const std::string &wanted) -> decltype(items.data())
{
  for (auto &item : items)
    if (item.*name == wanted)
      return &item;
  return nullptr;
}

/// Length of the UTF-8 character that starts at `begin`, or 0 if it is none.
std::size_t utf8_length(const std::string &text, const std::size_t begin)
{
  const auto byte = [&](const std::size_t i) {
    return begin + i < text.size() ? static_cast<unsigned char>(text[begin + i]) : 0u;
  };
  const unsigned int first = byte(0);
  if (first < 0x80)
    return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0 ? 2 : first >= 0xE0 && first < 0xF0 ? 3 : 4;
  if (first < 0xC2 || first > 0xF4)
    return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80)
      return 0;
  // Overlong forms, surrogates, and what is beyond the last code point.
  if ((first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) >= 0xA0) ||
      (first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) >= 0x90))
    return 0;
  return length;
}

/// Refuses what is no text. Later messages can then repeat the user's words without harm.
void check_characters(const std::string &text, const Origin &origin)
{
  for (std::size_t i = 0; i < text.size();) {
    const unsigned int c = static_cast<unsigned char>(text[i]);
    if (c == 0)
      throw InputError(origin, "a NUL byte, which no text has");
    if ((c < 32 && c != '\t') || c == 127)
      throw InputError(origin, "a control character (code " + std::to_string(c) + ")");
    const std::size_t length = utf8_length(text, i);
    if (length == 0)
      throw InputError(origin, "bytes that are not UTF-8 (near " + in_quotes(text.substr(0, i)) + ")");
    i += length;
  }
}

/// Single blanks inside, none around, as in deal.II. A no-break space, as copied from a web page, is a blank
/// too.
std::string normalize(const std::string &text)
{
  std::string result;
  bool blank = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool no_break_space = text.compare(i, 2, "\xC2\xA0") == 0;
    if (no_break_space)
      ++i;
    if (no_break_space || text[i] == ' ' || text[i] == '\t') {
      blank = true;
      continue;
    }
    if (blank && !result.empty())
      result += ' ';
    blank = false;
    result += text[i];
  }
  return result;
}

/// The bytes of a file, without a byte order mark.
std::string load(const std::string &file_name, const Origin &includer)
{
  const auto fail = [&](const std::string &reason) {
    throw InputError(includer, "cannot read the file " + in_quotes(file_name) + ": " + reason);
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(file_name, ignored))
    fail("it is a directory");
  errno = 0;
  std::ifstream stream(file_name, std::ios::binary);
  if (!stream)
    fail(errno != 0 ? std::strerror(errno) : "it cannot be opened");
  std::string content((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (stream.bad())
    fail("an error while reading");
  if (content.compare(0, 3, "\xEF\xBB\xBF") == 0)
    content.erase(0, 3);
  return content;
}

/// The name that tells whether two files are the same one.
std::string canonical(const std::string &file_name)
{
  std::error_code error;
  const std::string result = std::filesystem::weakly_canonical(file_name, error).string();
  return error ? file_name : result;
}

/// Hands out the lines of a file without comments and line ends, continued lines joined.
class Lines
{
public:
  Lines(const std::string &content, const std::string &file_name) : content(content), file_name(file_name) {}

  /// False after the last line. `origin` is where the line begins.
  bool next(std::string &line, Origin &origin)
  {
    line.clear();
    if (position >= content.size())
      return false;
    origin = {file_name, line_number + 1};
    bool continued = false;
    while (position < content.size()) {
      bool only_comment = false;
      const std::string physical = next_physical(only_comment);
      // A comment between the parts of a continued line does not end it.
      if (continued && only_comment)
        continue;
      continued = !physical.empty() && physical.back() == '\\';
      line += continued ? physical.substr(0, physical.size() - 1) : physical;
      if (!continued)
        return true;
    }
    throw InputError(origin, "this line is continued with '\\', but the file ends");
  }

private:
  std::string next_physical(bool &only_comment)
  {
    const std::size_t end = std::min(content.find('\n', position), content.size());
    std::string line = content.substr(position, end - position);
    position = end + 1;
    ++line_number;
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    check_characters(line, {file_name, line_number});
    const std::size_t comment = line.find('#');
    line = normalize(line.substr(0, comment));
    only_comment = comment != std::string::npos && line.empty();
    return line;
  }

  const std::string &content;
  const std::string &file_name;
  std::size_t position = 0;
  unsigned int line_number = 0;
};

class Reader
{
public:
  void read(const std::string &file_name, PrmSection &section, const Origin &includer);
  void override(const std::string &text, PrmSection &root);

private:
  /// A file that is or was open. The includer of the first is itself.
  struct Reading
  {
    std::string file_name;
    std::string canonical_name;
    unsigned int includer;
  };

  void read_line(const std::string &line, const Origin &origin);
  void set(const std::string &text, const Origin &origin);
  void set(PrmSection &section, const PrmEntry &entry);
  void open_section(const std::string &name, const Origin &origin);
  void include(const std::string &name, const Origin &origin);
  PrmSection &section_in(PrmSection &parent, const std::string &name, const Origin &origin, bool is_override);
  bool includes(unsigned int outer, unsigned int inner) const;

  std::vector<Reading> readings;
  /// Number of the file being read.
  unsigned int current = 0;
  /// The sections that are open, the innermost last, and where each was opened.
  std::vector<PrmSection *> open;
  std::vector<Origin> opened_at;
  unsigned int n_items = 0;
};

void Reader::read(const std::string &file_name, PrmSection &section, const Origin &includer)
{
  const std::string content = load(file_name, includer);
  const unsigned int outer = current;
  current = readings.size();
  readings.push_back({file_name, canonical(file_name), outer});
  const std::size_t n_open = open.size();
  open.push_back(&section);
  opened_at.push_back({});

  Lines lines(content, file_name);
  std::string line;
  Origin origin;
  while (lines.next(line, origin)) {
    if (line == "end" || line == "END") {
      if (open.size() == n_open + 1)
        throw InputError(origin, "'end' without an open subsection");
      open.pop_back();
      opened_at.pop_back();
    } else if (!line.empty())
      read_line(line, origin);
  }
  if (open.size() > n_open + 1)
    throw InputError(opened_at.back(), "the subsection " + in_quotes(open.back()->name) +
                                           " opened here has no 'end' before the file ends");
  open.pop_back();
  opened_at.pop_back();
  current = outer;
}

void Reader::read_line(const std::string &line, const Origin &origin)
{
  const std::size_t blank = std::min(line.find(' '), line.size());
  const std::string word = line.substr(0, blank);
  const std::string rest = trim(line.substr(blank));
  // deal.II takes these words in capitals as well.
  if (word == "set" || word == "SET")
    set(rest, origin);
  else if (word == "subsection" || word == "SUBSECTION")
    open_section(rest, origin);
  else if (word == "include" || word == "INCLUDE")
    include(rest, origin);
  else if (word == "end" || word == "END")
    throw InputError(origin, in_quotes(rest) + " after 'end'; write it as a comment '# ...'");
  else
    throw InputError(origin, "cannot understand " + in_quotes(line) + "; " + what_a_line_is);
}

void Reader::set(const std::string &text, const Origin &origin)
{
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw InputError(origin, "no '=' after " + in_quotes("set " + text) + "; write 'set KEY = VALUE'");
  PrmEntry entry;
  entry.key = trim(text.substr(0, equals));
  entry.value = trim(text.substr(equals + 1));
  entry.origin = origin;
  entry.reading = current;
  if (entry.key.empty())
    throw InputError(origin, "no name between 'set' and '='; write 'set KEY = VALUE'");
  set(*open.back(), entry);
}

void Reader::set(PrmSection &section, const PrmEntry &entry)
{
  PrmEntry *const present = find(section.entries, &PrmEntry::key, entry.key);
  if (present == nullptr) {
    section.entries.push_back(entry);
    section.entries.back().order = n_items++;
    return;
  }
  const std::string before =
      in_quotes(entry.key) + " is set already in line " + std::to_string(present->origin.line);
  if (present->reading == entry.reading)
    throw InputError(entry.origin, before);
  // Nobody expects an included file to overrule the file that includes it.
  if (includes(present->reading, entry.reading))
    throw InputError(entry.origin, before + " of " + in_quotes(present->origin.file) +
                                       ", which includes this file; to override, set it after the include");
  present->value = entry.value;
  present->origin = entry.origin;
  present->reading = entry.reading;
}

bool Reader::includes(const unsigned int outer, unsigned int inner) const
{
  while (inner != readings[inner].includer) {
    inner = readings[inner].includer;
    if (inner == outer)
      return true;
  }
  return false;
}

void Reader::open_section(const std::string &name, const Origin &origin)
{
  if (name.empty())
    throw InputError(origin, "'subsection' without a name");
  // Messages and overrides write paths with it, and names become names of files.
  if (name.find('/') != std::string::npos)
    throw InputError(origin, "the name " + in_quotes(name) + " of a subsection must not contain '/'");
  if (open.size() > max_depth)
    throw InputError(origin, "more than " + std::to_string(max_depth) + " subsections inside each other");
  open.push_back(&section_in(*open.back(), name, origin, false));
  opened_at.push_back(origin);
}

PrmSection &Reader::section_in(PrmSection &parent, const std::string &name, const Origin &origin,
                               const bool is_override)
{
  if (PrmSection *const present = find(parent.sections, &PrmSection::name, name))
    return *present;
  parent.sections.push_back({name, origin, n_items++, is_override, {}, {}});
  return parent.sections.back();
}

void Reader::include(const std::string &name, const Origin &origin)
{
  if (name.empty())
    throw InputError(origin, "'include' without the name of a file");
  const std::string path = (std::filesystem::path(origin.file).parent_path() / name).string();
  const std::string canonical_name = canonical(path);
  std::string chain = path;
  for (unsigned int file = current;; file = readings[file].includer) {
    chain = readings[file].file_name + " -> " + chain;
    if (readings[file].canonical_name == canonical_name)
      throw InputError(origin, "files include each other in a circle: " + chain);
    if (file == readings[file].includer)
      break;
  }
  read(path, *open.back(), origin);
}

void Reader::override(const std::string &text, PrmSection &root)
{
  const Origin origin{"--set " + shortened(text, 200), 0};
  check_characters(text, origin);
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw InputError(origin, "no '='; write --set \"Section/Key=value\"");
  PrmEntry entry;
  entry.value = normalize(text.substr(equals + 1));
  entry.origin = origin;
  entry.reading = readings.size();
  entry.only_override = true;
  // The complete parameters are written to a file that has to be readable again.
  if (entry.value.find('#') != std::string::npos || (!entry.value.empty() && entry.value.back() == '\\'))
    throw InputError(origin, "a value cannot contain '#' or end with '\\'");

  PrmSection *section = &root;
  std::string path = text.substr(0, equals);
  unsigned int depth = 0;
  for (std::size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/')) {
    const std::string name = normalize(path.substr(0, slash));
    if (name.empty() || ++depth > max_depth)
      throw InputError(origin, name.empty() ? "an empty name in the path" : "the path is too long");
    section = &section_in(*section, name, origin, true);
    path.erase(0, slash + 1);
  }
  entry.key = normalize(path);
  if (entry.key.empty())
    throw InputError(origin, "no name before '='; write --set \"Section/Key=value\"");
  // Repeated overrides replace each other: the last one counts, as with other options of a command line.
  readings.push_back({origin.file, "", static_cast<unsigned int>(readings.size())});
  set(*section, entry);
}
} // namespace

const PrmEntry *PrmSection::find_entry(const std::string &key) const
{
  return find(entries, &PrmEntry::key, key);
}

const PrmSection *PrmSection::find_section(const std::string &section) const
{
  return find(sections, &PrmSection::name, section);
}

PrmSection read_prm(const std::string &file_name, const std::vector<std::string> &overrides)
{
  PrmSection root;
  Reader reader;
  reader.read(file_name, root, {});
  for (const std::string &text : overrides)
    reader.override(text, root);
  return root;
}
} // namespace peat
