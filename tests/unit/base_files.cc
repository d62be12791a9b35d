// Parameter files: what is read, what is written, and that the one reproduces the other.

#define BOOST_TEST_MODULE base_files
#include <boost/test/unit_test.hpp>

#include "base_scene.h"

#include <cmath>

BOOST_FIXTURE_TEST_SUITE(parameter_files, Directory)

BOOST_AUTO_TEST_CASE(everything_is_read)
{
  write("case.prm", good_text);
  const Scene scene = read_scene();
  BOOST_TEST(scene.title == "A block falls");
  BOOST_TEST(scene.dimension == 2u);
  BOOST_TEST((scene.upper == std::vector<double>{10., 11.}));
  BOOST_TEST((scene.levels == std::vector<double>{1., 0.1, 1e-7, 1. / 3.}));
  BOOST_TEST(scene.periodic);
  BOOST_TEST((scene.names == std::vector<std::string>{"ground", "block"}));
  BOOST_TEST(scene.springs[0]->stiffness() == 2e11);
  BOOST_TEST(scene.springs[1]->stiffness() == 1e7);
  const double x[3] = {0., 0., 0.};
  BOOST_TEST(scene.velocity.value(x, 0., 1) == -std::sqrt(2 * 9.81 * 5.));
  BOOST_TEST(scene.velocity.value(x, 1., 1) == 0.);
  BOOST_TEST(scene.friction == 0.1 + 0.2);
  BOOST_TEST(!scene.wet);
  BOOST_TEST((scene.fields == std::vector<std::string>{"velocity", "stress"}));
  BOOST_TEST((scene.columns == std::vector<std::string>{"a(1, 2)", "b"}));
  BOOST_TEST(scene.format == "vtu");
}

BOOST_AUTO_TEST_CASE(sections_know_where_they_are)
{
  write("case.prm", good_text);
  const ParameterFile file("case.prm", {});
  const Section root = file.root();
  const Section ground = root.subsection("Bodies").subsection("ground");
  BOOST_TEST(root.path() == "");
  BOOST_TEST(ground.path() == "Bodies/ground");
  BOOST_TEST(ground.name() == "ground");
  BOOST_TEST(ground.origin().prefix() == "case.prm:19: ");
  BOOST_TEST(ground.origin("Porosity").prefix() == "case.prm:24: ");
  // What the file does not set or open stands where it would have to be written.
  BOOST_TEST(ground.origin("Density").prefix() == "case.prm:19: ");
  BOOST_TEST(ground.subsection("missing").origin().prefix() == "case.prm:19: ");
  BOOST_TEST(root.subsection("Missing").origin().prefix() == "case.prm: ");
  BOOST_TEST(ground.has("Porosity"));
  BOOST_TEST(!ground.has("Density"));
  BOOST_TEST(ground.has_subsection("cubic"));
  BOOST_TEST(!ground.has_subsection("linear"));
  BOOST_TEST(!ground.describing());
  BOOST_TEST(ground.constants().at("Height") == 5.);
  BOOST_TEST(message_of([&] { ground.fail("Porosity", "too small"); }) ==
             "case.prm:24: Bodies/ground/Porosity: too small");
  BOOST_TEST(message_of([&] { ground.fail("Density", "is missing"); }) ==
             "case.prm:19: Bodies/ground/Density: is missing");
  BOOST_TEST(message_of([&] { root.fail("", "no bodies"); }) == "case.prm: no bodies");
}

BOOST_AUTO_TEST_CASE(forms_of_files)
{
  std::string crlf;
  for (const char c : good_text)
    crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  for (const std::string &text :
       {good_text, crlf, "\xEF\xBB\xBF" + good_text, good_text + "# no end of line",
        replaced(good_text, "set Title     =", "\tSET\tTitle="),
        replaced(good_text, "set Title     =", "set\xC2\xA0Title ="),
        replaced(good_text, "2*Height \\\n", "2*Height \\ # 1\n # a comment between\n")}) {
    write("case.prm", text);
    const Scene scene = read_scene();
    BOOST_TEST(scene.title == "A block falls");
    BOOST_TEST(scene.upper[1] == 11.);
  }
  // A comment that ends in a backslash does not swallow the next line.
  write("case.prm", "# C:\\\nset Dimension = 3\n");
  BOOST_TEST(read_scene().dimension == 3u);
  // A section opened twice is one; an empty file is a file; so is a line of a million characters.
  write("case.prm", "subsection Grid\nset Levels = 1\nend\nsubsection Grid\nset Periodic = true\nend\n");
  BOOST_TEST(read_scene().periodic);
  BOOST_TEST(read_scene().levels.size() == 1u);
  write("case.prm", "");
  BOOST_TEST(read_scene().names.empty());
  write("case.prm", "set Title = " + std::string(1000000, 'x'));
  BOOST_TEST(read_scene().title.size() == 1000000u);
  write("case.prm", "set Title = \xC3\xA9t\xC3\xA9 = a = b\n");
  BOOST_TEST(read_scene().title == "\xC3\xA9t\xC3\xA9 = a = b");
  // Text and lists may be empty.
  write(
      "case.prm",
      "set Title =\nsubsection Output\nset Fields =\nset Columns =\nend\nsubsection Grid\nset Levels =\nend");
  BOOST_TEST(read_scene().fields.empty());
}

BOOST_AUTO_TEST_CASE(whole_numbers)
{
  for (const char *const text : {"3", "1 + 2", "0.3/0.1", "3 + 1e-10"}) {
    write("case.prm", std::string("set Dimension = ") + text);
    BOOST_TEST(read_scene().dimension == 3u);
  }
}

BOOST_AUTO_TEST_CASE(includes)
{
  std::filesystem::create_directories("below");
  write("below/base.prm",
        "set Title = base\nset Dimension = 3\nsubsection Constants\nset a = 2\nset b = 2*a\nend\n"
        "include grid.prm\n");
  write("below/grid.prm", "subsection Grid\nset Levels = b\nend\n");
  write("case.prm", "include below/base.prm\nset Title = case\nsubsection Constants\nset a = 5\nend\n");
  const Scene scene = read_scene();
  BOOST_TEST(scene.title == "case");
  BOOST_TEST(scene.dimension == 3u);
  // The including file's constant counts for those that the included file computes from it.
  BOOST_TEST(scene.levels[0] == 10.);

  // Inside a section, and twice.
  write("below/body.prm", "set Friction = 0.25\n");
  write("case.prm", "subsection Bodies\nsubsection a\ninclude below/body.prm\nend\n"
                    "subsection b\ninclude below/body.prm\nend\nend\n");
  BOOST_TEST(read_scene().friction == 0.25);

  // Messages name the included file.
  write("below/body.prm", "\nset Friction = 2\n");
  BOOST_TEST(
      has(message_of([] { read_scene(); }), "below/body.prm:2: Bodies/a/Friction: 2 must be > 0 and < 1"));

  // Of two included files the later one counts.
  write("one.prm", "set Title = one\n");
  write("two.prm", "set Title = two\n");
  write("case.prm", "include one.prm\ninclude two.prm\n");
  BOOST_TEST(read_scene().title == "two");
}

BOOST_AUTO_TEST_CASE(overrides)
{
  write("case.prm", good_text);
  BOOST_TEST(read_scene({"Title=New = title"}).title == "New = title");
  BOOST_TEST(read_scene({"Constants/Width = 20"}).upper[1] == 21.);
  BOOST_TEST(read_scene({"Constants/Height=Width"}).upper[1] == 21.);
  BOOST_TEST(read_scene({" Bodies / block / Friction = 0.75 "}).friction == 0.75);
  BOOST_TEST(read_scene({"Dimension=2", "Dimension=3"}).dimension == 3u);
  BOOST_TEST(read_scene({"Output/Restart/Interval=7"}).restart_interval == 7.);
  BOOST_TEST(read_scene({"Bodies/block/Law=cubic", "Bodies/block/cubic/Cubic stiffness=3"})
                 .springs[1]
                 ->stiffness() == 3.);
  write("case.prm", "");
  BOOST_TEST(read_scene({"Output/Format=hdf5"}).format == "hdf5");
}

BOOST_AUTO_TEST_CASE(constants)
{
  // The place of the section in the file does not matter.
  write("case.prm",
        "subsection Grid\nset Levels = a\nend\nsubsection Constants\nset e = 0.6\nset a = e + 1\nend\n");
  BOOST_TEST(read_scene().levels[0] == 1.6);
}
BOOST_AUTO_TEST_CASE(declared_twice)
{
  write("case.prm", "set Density = 3\n");
  const ParameterFile file("case.prm", {});
  Section root = file.root();
  double a = 1., b = 2.;
  root.add("Density", a, positive("kg/m^3"), "Mass per volume.");
  root.add("Density", b, positive("kg/m^3"), "Mass per volume.");
  BOOST_TEST(a == 3.);
  BOOST_TEST(b == 3.);
  BOOST_TEST(prm_of(file) == "# Mass per volume [kg/m^3], > 0, default 1\nset Density = 3\n");
  BOOST_CHECK_THROW(root.add("Density", a, positive("g/m^3"), "Mass per volume."), std::logic_error);
}

BOOST_AUTO_TEST_CASE(written_parameters_reproduce_the_run)
{
  for (const std::vector<std::string> &overrides : {std::vector<std::string>{},
                                                    {"Constants/Width=1/3", "Output/Restart/Interval=2*g"},
                                                    {"Title=", "Output/Fields="}}) {
    write("case.prm", good_text);
    const ParameterFile first("case.prm", overrides);
    const Scene a(first.root());
    first.refuse_unknown_entries();
    const std::string text = prm_of(first);

    write("again.prm", text);
    const ParameterFile second("again.prm", {});
    const Scene b(second.root());
    second.refuse_unknown_entries();
    BOOST_TEST(prm_of(second) == text);

    BOOST_TEST(a.title == b.title);
    BOOST_TEST((a.upper == b.upper));
    BOOST_TEST((a.levels == b.levels));
    BOOST_TEST(a.periodic == b.periodic);
    BOOST_TEST((a.names == b.names));
    BOOST_TEST(a.springs[0]->stiffness() == b.springs[0]->stiffness());
    BOOST_TEST(a.velocity.text() == b.velocity.text());
    const double x[3] = {0., 0., 0.};
    BOOST_TEST(a.velocity.value(x, 0.5, 1) == b.velocity.value(x, 0.5, 1));
    BOOST_TEST(a.friction == b.friction);
    BOOST_TEST(a.end == b.end);
    BOOST_TEST(a.wet == b.wet);
    BOOST_TEST((a.fields == b.fields));
    BOOST_TEST((a.columns == b.columns));
    BOOST_TEST(a.restart_interval == b.restart_interval);
  }
}

BOOST_AUTO_TEST_CASE(written_parameters_look_right)
{
  write("case.prm", "subsection Bodies\nsubsection a\nset Friction = 1/4\nend\nend\n");
  const ParameterFile file("case.prm", {});
  Scene scene(file.root());
  BOOST_TEST(prm_of(file) == R"(# What the run is called, default empty
set Title =
# Number of directions in space, >= 2 and <= 3, default 2
set Dimension = 2

subsection Bodies

  subsection a
    # How it resists. 'cubic': Force grows with the third power. 'linear': Force proportional to
    # length, default linear
    set Law = linear
    # Velocity at the start [m/s], default 0, 0
    set Velocity = 0, 0
    # Ratio of tangential to normal force, > 0 and < 1, default 0.5
    set Friction = 0.25
    # When it is taken away [s], > 0, no default
    # set End =

    subsection linear
      # Force per length [N/m], > 0, default 1e7
      set Stiffness = 1e7
    end
  end
end

subsection Grid
  # The corner opposite to the origin [m], default 1, 1
  set Upper corner = 1, 1
  # Any number of numbers, >= 0, default empty
  set Levels =
  # Whether opposite sides are one, of: true, false, default false
  set Periodic = false
end

subsection Output
  # What is written, of: stress, velocity, pressure, default stress
  set Fields = stress
  # Names of columns, default empty
  set Columns =
  # Kind of file, of: vtu, hdf5, default vtu
  set Format = vtu
end
)");
}

BOOST_AUTO_TEST_CASE(reference)
{
  const ParameterFile file = ParameterFile::describing();
  BOOST_TEST(file.root().describing());
  BOOST_TEST(!file.root().has("Title"));
  Scene scene(file.root());
  file.refuse_unknown_entries();
  BOOST_TEST((scene.names == std::vector<std::string>{"NAME"}));

  // The default file can be run; what its presence would change stands as a comment.
  const std::string text = prm_of(file);
  write("case.prm", text);
  read_scene();
  BOOST_TEST(has(text, "\n    # subsection cubic\n"));
  BOOST_TEST(has(text, "\n    # set Porosity = 0.4\n"));
  BOOST_TEST(has(
      text,
      "\n  # subsection Restart\n  #   # Time between two [s], > 0, default 1\n  #   set Interval = 1\n"));

  std::ostringstream markdown;
  file.write_markdown(markdown);
  BOOST_TEST(has(markdown.str(), "\n## Bodies/NAME/cubic\n"));
  BOOST_TEST(has(markdown.str(), "\n| Stiffness | 1e7 | N/m | > 0 | Force per length. |\n"));
  BOOST_TEST(has(markdown.str(), "\n| Format | vtu | - | vtu, hdf5 | Kind of file. |\n"));
  BOOST_TEST(has(markdown.str(), "\n| End | - | s | > 0 | When it is taken away. |\n"));

  std::ostringstream json;
  file.write_json(json);
  BOOST_TEST(has(json.str(), R"({"section": "Bodies/NAME/linear", "entry": "Stiffness", "kind": "number", )"
                             R"("unit": "N/m", "range": "> 0", "choices": [], "default": 1e7, "value": 1e7, )"
                             R"("text": "Force per length."})"));
  BOOST_TEST(has(
      json.str(),
      R"("entry": "End", "kind": "number", "unit": "s", "range": "> 0", "choices": [], "default": null)"));
  BOOST_TEST(has(json.str(),
                 R"("entry": "Upper corner", "kind": "numbers", "unit": "m", "range": "", "choices": [], )"
                 R"("default": [1, 1])"));
  BOOST_TEST(has(json.str(), R"("choices": ["vtu", "hdf5"], "default": "vtu")"));
}

BOOST_AUTO_TEST_SUITE_END()
