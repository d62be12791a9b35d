#pragma once

// A small program's worth of parameters, for the tests of parameter files. Include after Boost.Test.

#include <peat/base/parameters.h>
#include <peat/base/registry.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <unistd.h>

using namespace peat;

/// A directory for one test; the current directory while it lives, so that messages have short file names.
class Directory
{
public:
  Directory()
      : before(std::filesystem::current_path()),
        path(std::filesystem::temp_directory_path() / ("peat_base_" + std::to_string(getpid())))
  {
    std::filesystem::create_directories(path);
    std::filesystem::current_path(path);
  }
  ~Directory()
  {
    std::filesystem::current_path(before);
    std::filesystem::remove_all(path);
  }

private:
  std::filesystem::path before, path;
};

inline void write(const std::string &file_name, const std::string &text)
{
  // Some file systems wait for the disk when an old file is overwritten.
  std::filesystem::remove(file_name);
  std::ofstream(file_name, std::ios::binary) << text;
}

/// A family with two members.
struct Spring
{
  virtual ~Spring() = default;
  virtual double stiffness() const = 0;
};

struct LinearSpring : Spring
{
  explicit LinearSpring(Section section)
  {
    section.add("Stiffness", k, positive("N/m"), "Force per length.");
  }
  double stiffness() const override { return k; }
  double k = 1e7;
};

struct CubicSpring : Spring
{
  explicit CubicSpring(Section section)
  {
    section.add("Cubic stiffness", k, positive("N/m^3"), "Force per volume.");
  }
  double stiffness() const override { return k; }
  double k = 5.;
};

const Member<Spring, LinearSpring> linear_spring("linear", "Force proportional to length.");
const Member<Spring, CubicSpring> cubic_spring("cubic", "Force grows with the third power.");

/// A program's worth of parameters: every kind of entry.
struct Scene
{
  explicit Scene(Section root)
  {
    root.add("Title", title, "What the run is called.");
    root.add("Dimension", dimension, between(2, 3), "Number of directions in space.");

    Section grid = root.subsection("Grid");
    grid.add("Upper corner", upper, 2, any("m"), "The corner opposite to the origin.");
    grid.add("Levels", levels, 0, nonnegative(""), "Any number of numbers.");
    grid.add("Periodic", periodic, "Whether opposite sides are one.");

    Section bodies = root.subsection("Bodies");
    for (const std::string &name : bodies.user_sections("NAME")) {
      Section body = bodies.subsection(name);
      names.push_back(body.name());
      springs.push_back(choose<Spring>(body, "Law", "linear", "How it resists."));
      body.add("Velocity", velocity, 2, "m/s", "Velocity at the start.");
      body.add("Friction", friction, strictly_between(0., 1.), "Ratio of tangential to normal force.");
      body.add("End", end, positive("s"), "When it is taken away.");
      wet = body.has("Porosity");
      if (wet || body.describing())
        body.add("Porosity", porosity, strictly_between(0., 1.), "Volume of the pores per volume.");
    }

    Section output = root.subsection("Output");
    output.add("Fields", fields, {"stress", "velocity", "pressure"}, "What is written.");
    output.add("Columns", columns, "Names of columns.");
    output.add("Format", format, {"vtu", "hdf5"}, "Kind of file.");
    if (output.has_subsection("Restart") || root.describing())
      output.subsection("Restart").add("Interval", restart_interval, positive("s"), "Time between two.");
  }

  std::string title;
  unsigned int dimension = 2;
  std::vector<double> upper = {1., 1.};
  std::vector<double> levels;
  bool periodic = false;
  std::vector<std::string> names;
  std::vector<std::unique_ptr<Spring>> springs;
  Function velocity;
  double friction = 0.5;
  double end = std::numeric_limits<double>::infinity();
  bool wet = false;
  double porosity = 0.4;
  std::vector<std::string> fields = {"stress"};
  std::vector<std::string> columns;
  std::string format = "vtu";
  double restart_interval = 1.;
};

const std::string good_text = R"(# A comment
set Title     = A block   falls   # and so on
set Dimension = 2

subsection Constants
  set Width  = 10     # [m]
  set Height = Width/2
  set g      = 9.81
end

subsection Grid
  set Upper corner = Width, 2*Height \
                     + max(0, 1)
  set Levels   = 1, 0.1, 1e-7, 1/3
  set Periodic = yes
end

subsection Bodies
  subsection ground
    set Law = cubic
    subsection cubic
      set Cubic stiffness = 2e11
    end
    set Porosity = 0.3
  end
  subsection block
    set Velocity = 0, -sqrt(2*g*Height)*(t < 1)
    set Friction = 0.1 + 0.2
  end
end

subsection Output
  set Fields  = velocity, stress
  set Columns = a(1, 2), b
end
)";

/// Reads the whole scene from the file "case.prm" and refuses what it does not know.
inline Scene read_scene(const std::vector<std::string> &overrides = {})
{
  const ParameterFile file("case.prm", overrides);
  Scene scene(file.root());
  file.refuse_unknown_entries();
  return scene;
}

/// What the InputError says; the test fails if there is none, or if it is not one line of text.
inline std::string message_of(const std::function<void()> &action)
{
  try {
    action();
  } catch (const InputError &error) {
    const std::string message = error.what();
    BOOST_TEST(!message.empty());
    BOOST_TEST(message.size() < 500);
    for (const char c : message)
      BOOST_TEST((static_cast<unsigned char>(c) >= 32), "control character in: " + message);
    BOOST_TEST_MESSAGE(message);
    return message;
  }
  BOOST_ERROR("no InputError");
  return "";
}

inline bool has(const std::string &text, const std::string &part)
{
  return text.find(part) != std::string::npos;
}

inline std::string prm_of(const ParameterFile &file)
{
  std::ostringstream out;
  file.write_prm(out);
  return out.str();
}

inline std::string replaced(std::string text, const std::string &from, const std::string &to)
{
  const std::size_t position = text.find(from);
  BOOST_REQUIRE(position != std::string::npos);
  return text.replace(position, from.size(), to);
}
