// Materials, dry and saturated: derived numbers, the stable step, ill-posed mixtures, bad input.

#define BOOST_TEST_MODULE material
#include <boost/test/unit_test.hpp>

#include <peat/material/material.h>

#include <map>
#include <sstream>

#include "section.h"

using namespace peat;

namespace {
Material material_of(const std::string &lines)
{
  return from_text(lines, [](const Section &section) { return Material(section); });
}

const std::string incomplete_sand =
    "set Porosity = 0.4\nset Grain density = 2650\nset Fluid density = 1000\n";
/// The material of the reference data N1.
const std::string sand = incomplete_sand + "set Fluid bulk modulus = 2.2e9\nset Reference gravity = 9.81\n";
} // namespace

BOOST_AUTO_TEST_CASE(numbers_of_a_saturated_sand)
{
  const Material material = material_of(sand + "set Hydraulic conductivity = 1e-4");
  BOOST_REQUIRE(material.mixture());
  const Mixture &mixture = *material.mixture();
  const auto tolerance = boost::test_tools::tolerance(1e-14);
  BOOST_TEST(material.name() == "sand");
  BOOST_TEST(material.density() == 0.4 * 1000. + 0.6 * 2650., tolerance);
  BOOST_TEST(mixture.Q() == 2.2e9 / 0.4, tolerance);
  BOOST_TEST(mixture.storage(broadcast(0.3))[4] == 0.3 / 2.2e9, tolerance);
  BOOST_TEST(mixture.mobility() == 1e-4 / 9810., tolerance);
  BOOST_TEST(mixture.r() == 1000. / 1990., tolerance);
  BOOST_TEST(mixture.drained_speed(1e7) == std::sqrt(1e7 / 1990.), tolerance);
  BOOST_TEST(mixture.undrained_speed(1e7) == std::sqrt((1e7 + 5.5e9) / 1990.), tolerance);
  BOOST_TEST(mixture.permeable_speed(1e7) == std::sqrt(1e7 / 990.), tolerance);
  BOOST_TEST(mixture.crossover(1e7) == (1e7 / 5.5e9 + 1.) / (990. * 1e-4 / 9810.), tolerance);
  BOOST_TEST(mixture.constant_conductivity());

  const Material rock = material_of(sand + "set Grain bulk modulus = 36e9\nset Biot coefficient = 0.8");
  BOOST_TEST(rock.mixture()->storage() == 0.4 / 36e9 + 0.4 / 2.2e9, tolerance);
  BOOST_TEST(rock.mixture()->r() == 800. / 1990., tolerance);
}

BOOST_AUTO_TEST_CASE(stable_step)
{
  // N1_timestep.csv, "safe formula up staggered": E = 1e7, nu = 0.3, h = 0.1
  const double modulus = 1e7 * 0.7 / (1.3 * 0.4);
  for (const auto &[k, step] : std::map<std::string, double>{{"1e-7", 6.006778116e-05},
                                                             {"1e-6", 5.997726073e-05},
                                                             {"1e-5", 5.907957109e-05},
                                                             {"1e-4", 5.084836529e-05},
                                                             {"1e-3", 1.656379381e-05},
                                                             {"1e-2", 1.791051387e-06},
                                                             {"1e-1", 1.792628668e-07}}) {
    const Material material = material_of(sand + "set Hydraulic conductivity = " + k);
    const Mixture &mixture = *material.mixture();
    BOOST_TEST(mixture.stable_step(modulus, 0.1, 0., true) == step, boost::test_tools::tolerance(3e-10));
    BOOST_TEST(mixture.stable_step(modulus, 0.1, 0., false) < step);
    BOOST_TEST(mixture.stable_step(modulus, 0.1, 100., true) < step);
  }
  // limits
  const Material material = material_of(sand + "set Hydraulic conductivity = 10");
  const double D = material.mixture()->Q() * material.mixture()->mobility();
  BOOST_TEST(material.mixture()->stable_step(modulus, 0.1, 0., false) == 0.01 / (2. * D),
             boost::test_tools::tolerance(1e-6));
}

BOOST_AUTO_TEST_CASE(ill_posed_mixtures)
{
  BOOST_TEST(material_of(sand).mixture()->well_posedness(1.35e7) > 0.);
  // M = 5e9 on a fluid with Q = 1e9
  const Material soft = material_of(incomplete_sand + "set Fluid bulk modulus = 0.4e9");
  BOOST_TEST(soft.mixture()->Q() == 1e9, boost::test_tools::tolerance(1e-14));
  const double r = 1000. / 1990.;
  BOOST_TEST(soft.mixture()->well_posedness(5e9) == 1e9 * (1. - r) - r * 5e9,
             boost::test_tools::tolerance(1e-13));
  BOOST_TEST(soft.mixture()->well_posedness(5e9) < 0.);
}

BOOST_AUTO_TEST_CASE(kozeny_carman)
{
  const Material material = material_of(sand + "set Conductivity law = kozeny-carman\nset Hydraulic "
                                               "conductivity = 1e-3\nset Reference porosity = 0.5");
  const Mixture &mixture = *material.mixture();
  const auto tolerance = boost::test_tools::tolerance(1e-14);
  BOOST_TEST(!mixture.constant_conductivity());
  BOOST_TEST(mixture.conductivity(broadcast(0.5))[0] == 1e-3, tolerance);
  BOOST_TEST(mixture.conductivity() == 1e-3 * 0.064 / 0.36 * 0.25 / 0.125, tolerance);
  BOOST_TEST(mixture.mobility(broadcast(0.3))[6] == 1e-3 * 0.027 / 0.49 * 2. / 9810., tolerance);
  BOOST_TEST(material_of(sand + "set Conductivity law = kozeny-carman\nset Hydraulic conductivity = 1e-3")
                     .mixture()
                     ->conductivity() == 1e-3,
             tolerance);
}

BOOST_AUTO_TEST_CASE(dry_or_saturated)
{
  const Material steel =
      material_of("set Law = hencky\nset Density = 7850\nsubsection hencky\nset Young modulus = 2e11\nend");
  BOOST_TEST(!steel.mixture());
  BOOST_TEST(steel.density() == 7850.);
  BOOST_TEST(steel.law().finite_strain());

  const auto complains_of = [](const std::string &word) {
    return
        [word](const InputError &error) { return std::string(error.what()).find(word) != std::string::npos; };
  };
  BOOST_CHECK_EXCEPTION(material_of(sand + "set Density = 2000"), InputError, complains_of("Density"));
  BOOST_CHECK_EXCEPTION(material_of(sand + "set Biot coefficient = 0.3"), InputError,
                        complains_of("Porosity"));
  BOOST_CHECK_THROW(material_of("set Porosity = 1"), InputError);
  BOOST_CHECK_THROW(material_of("set Porosity = 0"), InputError);
  BOOST_CHECK_THROW(material_of("set Law = hookean"), InputError);
  for (const std::string &entry : Mixture::entries())
    BOOST_CHECK_EXCEPTION(material_of("set Density = 2000\nset " + entry + " = 0.5"), InputError,
                          complains_of(entry + ": belongs to saturated"));
}

BOOST_AUTO_TEST_CASE(every_entry_is_described)
{
  ParameterFile file = ParameterFile::describing();
  const Material material(file.root().subsection("sand"));
  std::ostringstream text;
  file.write_markdown(text);
  std::vector<std::string> entries = Mixture::entries();
  for (const char *entry : {"Law", "Density", "Porosity", "Young modulus", "Poisson ratio"})
    entries.push_back(entry);
  for (const std::string &entry : entries)
    BOOST_TEST(text.str().find(entry) != std::string::npos, entry);
}
