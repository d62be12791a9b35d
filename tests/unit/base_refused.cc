// Parameter files that are refused: each in one line that names the place and the word.

#define BOOST_TEST_MODULE base_refused
#include <boost/test/unit_test.hpp>

#include "base_scene.h"

#include <random>

BOOST_FIXTURE_TEST_SUITE(parameter_files, Directory)
/// A file, the line that is to blame, and what the message has to say.
struct Bad
{
  std::string text;
  unsigned int line;
  std::string word;
};

std::string in_grid(const std::string &line)
{
  return "\nsubsection Grid\n" + line + "\nend\n";
}

std::string in_body(const std::string &line)
{
  return "subsection Bodies\nsubsection sand\n" + line + "\nend\nend\n";
}

std::string in_constants(const std::string &lines)
{
  return "subsection Constants\n" + lines + "\nend\n";
}

BOOST_AUTO_TEST_CASE(bad_files)
{
  const std::vector<Bad> cases = {
      // The format
      {"\nTitle = 3\n", 2, "cannot understand 'Title = 3'"},
      {"set Title 3\n", 1, "no '='"},
      {"set\n", 1, "no '='"},
      {"set=3\n", 1, "cannot understand"},
      {"set = 3\n", 1, "no name"},
      {"\n\nend\n", 3, "'end' without"},
      {"subsection Grid\nend\nend\n", 3, "'end' without"},
      {"\nsubsection Grid\nset Levels = 1\n", 2, "'Grid' opened here has no 'end'"},
      {"subsection Bodies\n subsection sand\n end\n", 1, "'Bodies' opened here has no 'end'"},
      {"subsection\nend\n", 1, "without a name"},
      {"subsection a/b\nend\n", 1, "'/'"},
      {"subsection Grid\nend Grid\n", 2, "after 'end'"},
      {"include\n", 1, "without the name"},
      {"set Title = a\n\nset Title = b\n", 3, "'Title' is set already in line 1"},
      {"subsection Grid\nset Levels = 1\nend\nsubsection Grid\nset Levels = 1\nend\n", 5,
       "already in line 2"},
      {"set Title = a\nset Title = \xC3\n", 2, "UTF-8"},
      {"set Title = \xC0\xAF\n", 1, "UTF-8"},
      {"set Title = \xED\xA0\x80\n", 1, "UTF-8"},
      {"set Title = \xF5\x80\x80\x80\n", 1, "UTF-8"},
      {std::string("set Title = a\n\0\n", 16), 2, "NUL"},
      {"set Title = a\rset Dimension = 3\n", 1, "control character"},
      {"\nset Title = a\x1B[0m\n", 2, "control character"},
      {"\nset Title = a \\\n", 2, "continued"},
      {"set Title = a\nset Dimension = \\\n 2 \\\n * 2\n", 2, "Dimension"},
      {"foo" + std::string(100000, 'o') + "\n", 1, "cannot understand"},
      // Names
      {"set Titel = 3\n", 1, "unknown entry 'Titel' at the top of the file; did you mean 'Title'?"},
      {in_grid("set Lvels = 1"), 3, "unknown entry 'Lvels' in Grid; did you mean 'Levels'?"},
      {in_grid("set levels = 1"), 3, "did you mean 'Levels'?"},
      {in_grid("set Something = 1"), 3, "known are 'Upper corner', 'Levels', 'Periodic'"},
      {in_grid("set Dimension = 3"), 3, "it belongs at the top of the file"},
      {"set Grid = 3\n", 1, "this is a section"},
      {"set Title = a\nsubsection Dimension\nend\n", 2, "this is an entry"},
      {"\nsubsection Gird\nset Levels = 1\nend\n", 2,
       "unknown section 'Gird' at the top of the file; did you mean 'Grid'?"},
      {"subsection Zzz\nend\n", 1, "known are"},
      {in_grid("subsection fine\nend"), 3, "there are no subsections"},
      {"subsection Bodies\nset Law = linear\nend\n", 2, "only subsections"},
      {in_body("subsection cubic\nend"), 3, "it belongs to Law = cubic, not to Law = linear"},
      {in_body("set Stiffness = 3"), 3, "it belongs in Bodies/sand/linear"},
      {in_body("subsection linear\nset Stifness = 3\nend"), 4,
       "in Bodies/sand/linear; did you mean 'Stiffness'?"},
      {"subsection Output\nsubsection Restart\nset Intervall = 3\nend\nend\n", 3, "did you mean 'Interval'?"},
      // The first in the order of the file, whatever the sections
      {"subsection Grid\nset a = 1\nend\nset b = 2\n", 2, "'a'"},
      {"set b = 2\nsubsection Grid\nset a = 1\nend\n", 1, "'b'"},
      {"subsection Grid\nend\nset b = 2\nsubsection Grid\nset a = 1\nend\n", 3, "'b'"},
      // Values
      {"set Dimension =\n", 1, "Dimension: the value is empty"},
      {"set Dimension = 2.5\n", 1, "Dimension: 2.5 must be a whole number"},
      {"set Dimension = -1\n", 1, "-1 must be >= 2 and <= 3"},
      {"set Dimension = 1e30\n", 1, "1e30 must be >= 2 and <= 3"},
      {"set Dimension = two\n", 1, "unknown name 'two'"},
      {in_grid("set Upper corner = 1"), 3, "2 numbers separated by commas are needed, not 1"},
      {in_grid("set Upper corner ="), 3, "not 0"},
      {in_grid("set Levels = 1, , 2"), 3, "comma"},
      {in_grid("set Levels = 1, -2"), 3, "Grid/Levels: -2 must be >= 0"},
      {in_grid("set Levels = 1, 1/0"), 3, "'1/0' is not finite"},
      {in_grid("set Periodic ="), 3, "'' is none of 'true', 'false'"},
      {in_grid("set Periodic = True"), 3, "did you mean 'true'?"},
      {in_body("set Law = liner"), 3, "'liner' is none of 'cubic', 'linear'; did you mean 'linear'?"},
      {in_body("set Law ="), 3, "none of"},
      {in_body("subsection linear\nset Stiffness = -3\nend"), 4,
       "Bodies/sand/linear/Stiffness: -3 must be > 0 N/m"},
      {in_body("subsection linear\nset Stiffness = 2 - 3\nend"), 4, "'2 - 3' = -1 must be > 0 N/m"},
      {in_body("subsection linear\nset Stiffness = log(-1)\nend"), 4, "not finite"},
      {in_body("subsection linear\nset Stiffness = 2*x\nend"), 4, "place and time"},
      {in_body("set Friction = 1"), 3, "1 must be > 0 and < 1"},
      {in_body("set Friction = 1e400"), 3, "Friction"},
      {in_body("set Porosity = 40%"), 3, "Porosity"},
      {in_body("set Velocity = 0"), 3, "Bodies/sand/Velocity: 2 components are needed, but '0' has 1"},
      {in_body("set Velocity = 0, 1, 2"), 3, "2 components are needed"},
      {in_body("set Velocity = 0, 1/0"), 3, "Bodies/sand/Velocity: '1/0' is not finite"},
      {in_body("set Velocity = 0, v*t"), 3, "unknown name 'v'"},
      {in_body("set Velocity ="), 3, "empty"},
      {"subsection Output\nset Fields = stress, speed\nend\n", 2, "'speed' is none of"},
      {"subsection Output\nset Fields = stress,\nend\n", 2, "comma"},
      // Constants
      {in_constants("set x = 3"), 2, "Constants/x: 'x' stands for place or time"},
      {in_constants("set sin = 3"), 2, "is a function"},
      {in_constants("set pow = 3"), 2, "is a function"},
      {in_constants("set 2a = 3"), 2, "letters, digits"},
      {in_constants("set a b = 3"), 2, "letters, digits"},
      {in_constants("set \xC3\xA9 = 3"), 2, "letters, digits"},
      {in_constants("set a ="), 2, "Constants/a: the value is empty"},
      {in_constants("set a = bb + b\nset b = 1"), 2, "'b' is set further below"},
      {in_constants("set a = bb\nset b = 1"), 2, "unknown name 'bb'"},
      {in_constants("set a = 1/0"), 2, "not finite"},
      {in_constants("set a = a"), 2, "unknown name 'a'"},
      {in_constants("subsection more\nend"), 2, "not the section 'more'"},
  };
  BOOST_TEST(cases.size() >= 30u);
  for (const Bad &bad : cases) {
    write("case.prm", bad.text);
    const std::string message = message_of([] { read_scene(); });
    BOOST_TEST(has(message, "case.prm:" + std::to_string(bad.line) + ": "),
               bad.text.substr(0, 200) + " -> " + message);
    BOOST_TEST(has(message, bad.word),
               bad.text.substr(0, 200) + " -> " + message + " should say " + bad.word);
  }

  std::string deep;
  for (unsigned int i = 0; i < 100000; ++i)
    deep += "subsection a\n";
  write("case.prm", deep);
  BOOST_TEST(has(message_of([] { read_scene(); }), "subsections inside each other"));
}
BOOST_AUTO_TEST_CASE(unused_user_sections)
{
  // The user's section is named, but no one reads anything from it.
  write("case.prm",
        "subsection Materials\nsubsection sand\nset Density = 1\nend\nsubsection clay\nend\nend\n");
  const ParameterFile file("case.prm", {});
  Section materials = file.root().subsection("Materials");
  BOOST_TEST(materials.user_sections("NAME").size() == 2u);
  double density = 0.;
  materials.subsection("clay");
  materials.subsection("sand").add("Density", density, positive("kg/m^3"), "Mass per volume.");
  BOOST_TEST(density == 1.);
  const std::string message = message_of([&] { file.refuse_unknown_entries(); });
  BOOST_TEST(message == "case.prm:5: the section 'clay' in Materials is used by nothing");
  // Sections and entries have names of their own, and a family may be empty.
  write("case.prm", "subsection Bodies\nend\n");
  BOOST_TEST(read_scene().names.empty());
}

BOOST_AUTO_TEST_CASE(member_without_parameters)
{
  write("case.prm", "set Law = rigid\nsubsection rigid\nend\n");
  const ParameterFile file("case.prm", {});
  Section root = file.root();
  std::string law = "linear";
  root.add("Law", law, {"linear", "rigid"}, "How it resists.");
  root.subsection("rigid");
  BOOST_TEST(message_of([&] { file.refuse_unknown_entries(); }) ==
             "case.prm:2: unknown section 'rigid' at the top of the file; it has no entries");
}

BOOST_AUTO_TEST_CASE(includes_refused)
{
  write("case.prm", "set Title = a\ninclude other.prm\n");
  write("other.prm", "\nset Title = b\n");
  std::string message = message_of([] { read_scene(); });
  BOOST_TEST(has(message, "other.prm:2: 'Title' is set already in line 1 of 'case.prm'"), message);

  write("other.prm", "include ./case.prm\n");
  message = message_of([] { read_scene(); });
  BOOST_TEST(has(message, "other.prm:1: "), message);
  BOOST_TEST(has(message, "case.prm -> other.prm -> ./case.prm"), message);

  write("case.prm", "include case.prm\n");
  BOOST_TEST(has(message_of([] { read_scene(); }), "case.prm -> case.prm"));

  write("case.prm", "\ninclude missing.prm\n");
  message = message_of([] { read_scene(); });
  BOOST_TEST(has(message, "case.prm:2: cannot read the file 'missing.prm': No such file"), message);

  write("case.prm", "\ninclude .\n");
  BOOST_TEST(
      has(message_of([] { read_scene(); }), "case.prm:2: cannot read the file '.': it is a directory"));
  write("case.prm", "include " + std::string(100000, 'x'));
  BOOST_TEST(has(message_of([] { read_scene(); }), "case.prm:1: "));
  write("case.prm", "subsection Grid\ninclude other.prm\nend");
  write("other.prm", "end\n");
  BOOST_TEST(has(message_of([] { read_scene(); }), "other.prm:1: 'end' without"));
  write("other.prm", "\nsubsection a\n");
  BOOST_TEST(has(message_of([] { read_scene(); }), "other.prm:2: the subsection 'a'"));

  BOOST_TEST(has(message_of([] { ParameterFile("missing.prm", {}); }), "cannot read the file 'missing.prm'"));
  BOOST_TEST(has(message_of([] { ParameterFile(".", {}); }), "directory"));
  BOOST_TEST(has(message_of([] { ParameterFile("", {}); }), "cannot read the file ''"));
}

BOOST_AUTO_TEST_CASE(overrides_refused)
{
  write("case.prm", good_text);
  for (const auto &[text, word] : std::vector<std::pair<std::string, std::string>>{
           {"Title", "no '='"},
           {"", "no '='"},
           {"=3", "no name"},
           {"Grid/=3", "no name"},
           {"/Title=3", "empty name"},
           {"Grid//Levels=3", "empty name"},
           {"Grid/Levls=3", "did you mean 'Levels'?"},
           {"Gird/Levels=3", "did you mean 'Grid'?"},
           {"Bodies/blokc/Friction=0.5", "no section 'blokc' in Bodies; did you mean 'block'?"},
           {"Constants/Heigth=5", "no constant 'Heigth'; did you mean 'Height'?"},
           {"Constants/new=5", "no constant 'new'; known are 'Width', 'Height', 'g'"},
           {"Constants/Width=Height", "'Height' is set further below"},
           {"Constants/a/b=1", "not the section 'a'"},
           {"Dimension=2.5", "whole number"},
           {"Title=a # b", "cannot contain '#'"},
           {"Title=a\\", "end with '\\'"},
           {"Title=a\nb", "control character"},
           {"Title=\xFF", "UTF-8"},
           {std::string("Title=a\0b", 9), "NUL"},
           {std::string(1000000, 'a') + "=3", "unknown entry"},
           {std::string(200000, '/') + "=3", "empty name"},
       }) {
    const std::string message = message_of([&, &override = text] { read_scene({override}); });
    BOOST_TEST(has(message, "--set "), message);
    BOOST_TEST(has(message, word), message);
  }
  std::string deep;
  for (unsigned int i = 0; i < 100000; ++i)
    deep += "a/";
  BOOST_TEST(has(message_of([&] { read_scene({deep + "b=1"}); }), "too long"));
}

BOOST_AUTO_TEST_CASE(random_damage)
{
  // Whatever is in the file: it is read, or refused in one line.
  std::mt19937 random(42);
  const auto below = [&](const std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::vector<std::string> pieces = {"set ",  "=",
                                           "end\n", "subsection ",
                                           "\n",    "include case.prm\n",
                                           "\\\n",  "#",
                                           "(",     ")",
                                           ",",     "1e308*10",
                                           "\xC3",  "\xE2\x88\x92",
                                           "Width", "/",
                                           "?",     ":",
                                           "\"",    "1",
                                           " ",     "sum(",
                                           "&&",    "<",
                                           "-",     "^",
                                           "e",     "\r",
                                           "if(",   "max("};
  unsigned int n_refused = 0;
  for (unsigned int i = 0; i < 6000; ++i) {
    std::string text = good_text;
    for (std::size_t n = 1 + below(4); n > 0; --n) {
      const std::size_t position = below(text.size());
      switch (below(4)) {
      case 0:
        text[position] = static_cast<char>(below(256));
        break;
      case 1:
        text.erase(position, 1 + below(20));
        break;
      case 2:
        text.insert(position, pieces[below(pieces.size())]);
        break;
      default:
        text.insert(position, text.substr(below(text.size()), below(30)));
      }
      if (text.empty())
        break;
    }
    write("case.prm", text);
    try {
      read_scene();
    } catch (const InputError &error) {
      ++n_refused;
      const std::string message = error.what();
      BOOST_REQUIRE(message.find_first_of("\n\r") == std::string::npos);
      BOOST_REQUIRE_MESSAGE(message.size() < 600, message);
      BOOST_REQUIRE_MESSAGE(has(message, "case.prm:"), message);
    }
  }
  // Most damage is seen; what is not has hit comments, titles and digits.
  BOOST_TEST(n_refused > 3000u);
  BOOST_TEST(n_refused < 6000u);
}

BOOST_AUTO_TEST_SUITE_END()
