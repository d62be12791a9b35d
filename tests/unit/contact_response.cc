#define BOOST_TEST_MODULE contact_response
#include <boost/test/unit_test.hpp>

#include "output_scene.h"

#include <peat/solver/body_contact.h>
#include <peat/solver/rigid_contact.h>

#include <random>

BOOST_TEST_GLOBAL_FIXTURE(Mpi);

// What contact makes of the accelerations and fluxes by a change of pore pressures: a projection that is
// symmetric, leaves no approach, and keeps momentum.

namespace {
/// Saturated ground in the middle of a step, and something that presses on it: an elastic block, or a rigid
/// one.
template <int dim>
struct Pressed
{
  Pressed(const std::string &law, const std::string &interface, const bool rigid)
  {
    const bool flat = dim == 2;
    const std::string lower = flat ? "0.3, 0.13, 1.7, 0.93" : "0.3, 0.3, 0.13, 1.7, 1.7, 0.93",
                      upper = flat ? "0.6, 0.929, 1.31, 1.5" : "0.6, 0.6, 0.929, 1.31, 1.2, 1.5";
    std::ostringstream text;
    text << "set Dimension = " << dim
         << "\nset Scheme = semi-implicit\nset Gravity = " << (flat ? "3, -10" : "3, 0, -10")
         << "\nsubsection Grid\n set Lower corner = " << (flat ? "0, 0" : "0, 0, 0")
         << "\n set Upper corner = " << (flat ? "2, 2" : "2, 2, 2")
         << "\n set Cells = " << (flat ? "16, 16" : "10, 10, 16")
         << "\nend\nsubsection Materials\n subsection soil\n set Porosity = 0.4\n"
         << " set Hydraulic conductivity = 1e-3\n end\n subsection steel\n set Density = 7850\n end\nend\n"
         << "subsection Bodies\n subsection ground\n set Material = soil\n set Shape = box(" << lower
         << ")\n set Initial velocity = " << (flat ? "0.1, 0.3" : "0.1, 0, 0.3") << "\n end\n";
    if (!rigid)
      text << " subsection block\n set Material = steel\n set Shape = box(" << upper << ")\n end\n";
    text << "end\n";
    if (rigid)
      text << "subsection Rigid bodies\n subsection block\n set Shape = box(" << upper
           << ")\n set Motion = free\n set Density = 2000\n end\nend\n";
    text << "subsection Contacts\n subsection c\n set Bodies = block, ground\n set Law = " << law
         << "\n set Interface = " << interface << "\n end\nend\n"
         << "subsection Stages\n subsection s\n set Duration = 1\n end\nend\n";
    write_file("pressed.prm", text.str());
    file = std::make_unique<ParameterFile>("pressed.prm", std::vector<std::string>());
    read_dimension(*file);
    parameters = std::make_unique<Case<dim>>(*file);
    scheme = std::make_unique<SchemeParameters>(parameters->scheme);
    scheme->implicit_pressure = true;
    grid = std::make_unique<Grid<dim>>(parameters->grid, comm);
    scene = make_scene(*parameters, *grid);

    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
      continua.push_back(
          std::make_unique<Continuum<dim>>(*scheme, *grid, scene, std::vector<std::size_t>{b}));
    ground = continua[0].get();
    Ledger<dim> book;
    for (const auto &continuum : continua) {
      continuum->number_nodes({});
      continuum->find_prescribed_rows();
      continuum->fields().contact_force.assign(continuum->nodes().size() * dim, 0.);
      continuum->couple_nodes();
      continuum->points_to_nodes(0., dt);
      continuum->add_loads();
      continuum->find_velocities();
      continuum->solve_momentum();
      continuum->constrain_motion(book);
    }
    if (rigid) {
      using Contact = RigidContact<dim>;
      block = scene.rigid_bodies.front().get();
      block->begin_step(0., dt, {});
      pair = std::make_unique<Contact>(scene.contacts.front(), *scheme, *grid, scene, *block, *ground,
                                       std::vector<std::size_t>{0}, true, tried_acceleration);
    } else {
      using Contact = BodyContact<dim>;
      pair = std::make_unique<Contact>(scene.contacts.front(), *scheme, *grid, scene, *continua[1], *ground,
                                       std::vector<std::size_t>{1}, std::vector<std::size_t>{0});
    }
    pair->match_nodes();
    pair->begin(dt);
    largest_impulse = pair->solve();
    for (const auto &continuum : continua)
      continuum->solve_darcy();
    pair->constrain_flux();
    pair->hold();
    ground->begin_pressure();
    ground->prepare_pressure();
  }

  std::vector<double> &acceleration(const unsigned int continuum)
  {
    return continua[continuum]->response().acceleration;
  }
  /// On the nodes of the ground.
  std::vector<double> random_forces(const unsigned int seed) const
  {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> some(-1., 1.);
    std::vector<double> forces(ground->nodes().size() * dim);
    for (double &force : forces)
      force = some(generator);
    return forces;
  }
  /// Response to these forces on the ground's nodes.
  void try_out(const std::vector<double> &forces)
  {
    auto &response = ground->response();
    for (std::size_t row = 0; row < forces.size(); ++row) {
      const double m = ground->mass(row / dim);
      response.acceleration[row] = m > 0. ? forces[row] / m : 0.;
      response.flux[row] = response.conductance[row] * forces[row];
    }
    for (std::size_t c = 1; c < continua.size(); ++c)
      std::fill(acceleration(c).begin(), acceleration(c).end(), 0.);
    tried_acceleration = {};
    pair->forget_reactions();
    pair->restrain_motion();
    pair->restrain_flux();
  }

  static constexpr double dt = 1e-4;
  Directory directory;
  std::unique_ptr<ParameterFile> file;
  std::unique_ptr<Case<dim>> parameters;
  std::unique_ptr<SchemeParameters> scheme;
  std::unique_ptr<Grid<dim>> grid;
  Scene<dim> scene;
  std::vector<std::unique_ptr<Continuum<dim>>> continua;
  Continuum<dim> *ground = nullptr;
  RigidBody<dim> *block = nullptr;
  typename RigidBody<dim>::Generalised tried_acceleration;
  std::unique_ptr<ContactPair<dim>> pair;
  double largest_impulse = 0.;
};

double product(const std::vector<double> &a, const std::vector<double> &b)
{
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.);
}

template <int dim>
void check(const std::string &law, const std::string &interface, const bool rigid)
{
  BOOST_TEST_CONTEXT(dim << "-D, " << law << ", " << interface << (rigid ? ", rigid" : ", elastic"))
  {
    Pressed<dim> scene(law, interface, rigid);
    BOOST_TEST(scene.largest_impulse > 0.);
    const auto f = scene.random_forces(1), g = scene.random_forces(2);

    // Symmetric, and between zero and what free nodes do.
    scene.try_out(f);
    const auto motion_f = scene.acceleration(0), flux_f = scene.ground->response().flux;
    double free_motion = 0., free_flux = 0.;
    for (std::size_t row = 0; row < f.size(); ++row) {
      const double m = scene.ground->mass(row / dim);
      free_motion += m > 0. ? f[row] * f[row] / m : 0.;
      free_flux += scene.ground->response().conductance[row] * f[row] * f[row];
    }
    BOOST_TEST(product(f, motion_f) < free_motion);
    BOOST_TEST(product(f, motion_f) > 0.);
    BOOST_TEST(product(f, flux_f) <= free_flux);
    BOOST_TEST(product(f, flux_f) > 0.);

    // Momentum.
    dealii::Tensor<1, dim> momentum, impulse;
    for (const auto &continuum : scene.continua)
      for (std::size_t i = 0; i < continuum->nodes().size(); ++i)
        for (unsigned int d = 0; d < dim; ++d)
          momentum[d] += continuum->mass(i) * continuum->response().acceleration[i * dim + d];
    for (std::size_t i = 0; i < scene.ground->nodes().size(); ++i)
      for (unsigned int d = 0; d < dim && scene.ground->mass(i) > 0.; ++d)
        impulse[d] += f[i * dim + d];
    if (rigid)
      for (unsigned int d = 0; d < dim; ++d)
        momentum[d] += scene.block->mass() * scene.tried_acceleration[d];
    BOOST_TEST((momentum - impulse).norm() < 1e-11 * std::sqrt(product(f, f)));

    scene.try_out(g);
    const auto motion_g = scene.acceleration(0), flux_g = scene.ground->response().flux;
    BOOST_TEST(std::abs(product(g, motion_f) - product(f, motion_g)) < 1e-11 * free_motion);
    BOOST_TEST(std::abs(product(g, flux_f) - product(f, flux_g)) < 1e-11 * free_flux);

    // Nothing is left to restrain: neither approach nor, where fluid cannot leave, flow.
    scene.pair->restrain_motion();
    scene.pair->restrain_flux();
    double left_motion = 0., left_flux = 0.;
    for (std::size_t row = 0; row < g.size(); ++row) {
      left_motion = std::max(left_motion, std::abs(scene.acceleration(0)[row] - motion_g[row]));
      left_flux = std::max(left_flux, std::abs(scene.ground->response().flux[row] - flux_g[row]));
    }
    BOOST_TEST(left_motion < 1e-11 * *std::max_element(motion_g.begin(), motion_g.end()));
    BOOST_TEST(left_flux < 1e-11 * *std::max_element(flux_g.begin(), flux_g.end()));
  }
}
} // namespace

BOOST_AUTO_TEST_CASE(restrained_in_the_plane)
{
  for (const bool rigid : {false, true})
    for (const std::string law : {"frictionless", "stick", "coulomb\n set Friction = 0.3"})
      for (const std::string interface : {"impermeable", "drained"})
        check<2>(law, interface, rigid);
}

BOOST_AUTO_TEST_CASE(restrained_in_space)
{
  for (const bool rigid : {false, true})
    check<3>("stick", "impermeable", rigid);
}
