#define BOOST_TEST_MODULE implicit_contact
#include <boost/test/unit_test.hpp>

#include "output_scene.h"

#include <peat/solver/up_solver.h>

#include <deal.II/lac/block_sparsity_pattern.h>
#include <deal.II/lac/sparsity_tools.h>

#include <random>

BOOST_TEST_GLOBAL_FIXTURE(Mpi);

// Forces of implicit contact against their derivatives and against each other.

namespace {
/// A rigid block on an elastic one, at a level of a step, with unknowns that some motion gives.
template <int dim>
struct Pressed
{
  Pressed(const std::string &law, const bool prescribed)
  {
    const bool flat = dim == 2;
    std::ostringstream text;
    text << "set Dimension = " << dim
         << "\nset Scheme = implicit\nset Gravity = " << (flat ? "0, -10" : "0, 0, -10")
         << "\nsubsection Grid\n set Lower corner = " << (flat ? "0, 0" : "0, 0, 0")
         << "\n set Upper corner = " << (flat ? "2, 2" : "2, 2, 2")
         << "\n set Cells = " << (flat ? "8, 8" : "5, 5, 8")
         << "\nend\nsubsection Materials\n subsection soil\n set Density = 2000\n end\nend\n"
         << "subsection Bodies\n subsection ground\n set Material = soil\n set Shape = box("
         << (flat ? "0.2, 0, 1.8, 0.9" : "0.3, 0.3, 0, 1.7, 1.7, 0.9") << ")\n end\nend\n"
         << "subsection Rigid bodies\n subsection block\n set Shape = box("
         << (flat ? "0.5, 0.9, 1.3, 1.5" : "0.5, 0.5, 0.9, 1.3, 1.3, 1.5") << ")\n"
         << (prescribed
                 ? " set Motion = prescribed\n set Velocity = " + std::string(flat ? "1, -1" : "1, 0.5, -1")
                 : std::string(" set Motion = free\n set Density = 2000"))
         << "\n end\nend\nsubsection Contacts\n subsection c\n set Bodies = block, ground\n set Law = " << law
         << "\n end\nend\nsubsection Stages\n subsection s\n set Duration = 1\n end\nend\n";
    write_file("implicit_contact.prm", text.str());
    file = std::make_unique<ParameterFile>("implicit_contact.prm", std::vector<std::string>());
    read_dimension(*file);
    parameters = std::make_unique<Case<dim>>(*file);
    grid = std::make_unique<Grid<dim>>(parameters->grid, comm);
    scene = make_scene(*parameters, *grid);
    space = std::make_unique<Space<dim>>(*grid, Nodes::gimp);
    nodes = std::make_unique<ActiveNodes<dim>>(*grid, 4);
    contact = std::make_unique<ImplicitContact<dim>>(*space, scene);

    std::vector<CellId> solid;
    for (const Slice &slice : scene.bodies.front()->slices())
      solid.push_back(slice.cell);
    scene.bodies.front()->accept_cells();
    std::sort(solid.begin(), solid.end());
    space->distribute(solid, {});
    nodes->rebuild(solid);
    free.close();
    BOOST_TEST(contact->enter());
    contact->match_nodes(*nodes, free);

    dealii::BlockDynamicSparsityPattern pattern(space->relevant());
    contact->for_each_coupling(
        [&](const auto &list) { free.add_entries_local_to_global(list, pattern, true); });
    for (const auto index : space->owned()[0])
      pattern.add(index, index);
    matrix.reinit(space->owned(), pattern, comm);
    residual.reinit(space->owned(), comm);
    for (BlockVector *vector : {&state.unknown, &state.rate_history, &state.second_history})
      vector->reinit(space->owned(), space->relevant(), comm);
    unknown.reinit(residual);

    level.dt = dt;
    level.time = dt;
    level.velocity = 1. / dt;
    level.acceleration = 1. / (dt * dt);
    level.old_velocity = -1. / dt;
    contact->begin_step(0.);
    contact->begin_stage(level, 0., dt, 0., 0.);
  }

  /// Random, so that some sites part and others are pressed.
  BlockVector some_motion(const unsigned int seed, const double size)
  {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> some(-size, size);
    BlockVector motion(residual);
    for (const auto index : space->owned()[0])
      motion.block(0)(index) = some(generator);
    motion.compress(dealii::VectorOperation::insert);
    return motion;
  }
  void assemble(const BlockVector &at, const bool with_matrix)
  {
    state.unknown = at;
    residual = 0.;
    if (with_matrix)
      matrix = 0.;
    GrossResidual gross{};
    UpSystem system{free, residual, gross};
    system.matrix = with_matrix ? &matrix : nullptr;
    contact->assemble(level, state, system);
    residual.compress(dealii::VectorOperation::add);
    if (with_matrix)
      matrix.compress(dealii::VectorOperation::add);
  }

  static constexpr double dt = 1e-3;
  Directory directory;
  std::unique_ptr<ParameterFile> file;
  std::unique_ptr<Case<dim>> parameters;
  std::unique_ptr<Grid<dim>> grid;
  Scene<dim> scene;
  std::unique_ptr<Space<dim>> space;
  std::unique_ptr<ActiveNodes<dim>> nodes;
  std::unique_ptr<ImplicitContact<dim>> contact;
  dealii::AffineConstraints<double> free;
  BlockMatrix matrix;
  BlockVector residual, unknown;
  StepState state;
  TimeLevel level;
};

template <int dim>
void check_derivative(const std::string &law)
{
  Pressed<dim> pressed(law, true);
  const BlockVector at = pressed.some_motion(1, 1e-4), direction = pressed.some_motion(2, 1e-4);
  // Multipliers first: friction needs a normal force to begin with.
  pressed.assemble(at, false);
  pressed.contact->augment(pressed.state);
  pressed.assemble(at, true);
  BlockVector predicted(pressed.residual);
  pressed.matrix.vmult(predicted, direction);
  // Forces are piecewise smooth; this far no site changes its state.
  constexpr double step = 1e-6;
  BlockVector forward = at, backward = at;
  forward.add(step, direction);
  backward.add(-step, direction);
  pressed.assemble(forward, false);
  BlockVector found = pressed.residual;
  pressed.assemble(backward, false);
  found -= pressed.residual;
  found *= -0.5 / step;
  BOOST_TEST(predicted.l2_norm() > 0.);
  const double size = predicted.l2_norm();
  found -= predicted;
  // Round-off of the differences; exact of all laws but where friction turns in 3-D.
  BOOST_TEST(found.l2_norm() <= 1e-6 * size);
}
} // namespace

BOOST_AUTO_TEST_CASE(derivatives)
{
  for (const std::string law :
       {"frictionless", "stick", "tied", "coulomb\n set Friction = 0.3", "coulomb\n set Friction = 100",
        "adhesive\n set Adhesion = 1e3\n set Friction = 0.3"}) {
    BOOST_TEST_CONTEXT(law)
    {
      check_derivative<2>(law);
      check_derivative<3>(law);
    }
  }
}

BOOST_AUTO_TEST_CASE(action_and_reaction)
{
  Pressed<3> pressed("coulomb\n set Friction = 0.3", true);
  pressed.assemble(pressed.some_motion(1, 1e-4), false);
  dealii::Tensor<1, 3> on_ground;
  for (const auto &node : pressed.space->displacement_nodes())
    for (unsigned int d = 0; d < 3; ++d)
      on_ground[d] += pressed.residual.block(0)(node.displacement[d]);
  Ledger<3> book;
  pressed.contact->book_work(pressed.level, 1., pressed.state.unknown.block(0), book);
  pressed.contact->accept(Pressed<3>::dt);
  const auto on_block = pressed.scene.rigid_bodies.front()->last_force;
  BOOST_TEST(on_ground.norm() > 0.);
  BOOST_TEST((on_ground + on_block).norm() <= 1e-12 * on_ground.norm());
  // The ground is pressed down, and dragged along with the block.
  BOOST_TEST(on_ground[2] < 0.);
  BOOST_TEST(on_ground[0] > 0.);
  const ContactState<3> state = pressed.scene.contact_states.at("c");
  BOOST_TEST((state.force - on_block).norm() <= 1e-12 * on_block.norm());
  BOOST_TEST(state.gap < 0.);
  // What the block does and what the ground takes differ by the friction.
  BOOST_TEST(book.contact_dissipation > 0.);
  BOOST_TEST((Ledger<3>(book).impulse - Pressed<3>::dt * on_ground).norm() <=
             1e-12 * Pressed<3>::dt * on_ground.norm());
}

BOOST_AUTO_TEST_CASE(cover)
{
  Pressed<2> pressed("stick", true);
  const auto &ground = *pressed.scene.bodies.front();
  BOOST_TEST(pressed.contact->cover(ground, {0.9, 0.9}) == &pressed.scene.contacts.front());
  // A cell is 0.25 wide.
  BOOST_TEST(pressed.contact->cover(ground, {1.5, 0.9}) == nullptr);
}

BOOST_AUTO_TEST_CASE(free_flight)
{
  // Far from balance with a body that falls by g, exact without contact.
  Pressed<2> pressed("frictionless", false);
  auto &contact = *pressed.contact;
  auto &block = *pressed.scene.rigid_bodies.front();
  // The ground gives way.
  BlockVector away(pressed.residual);
  for (const auto &node : pressed.space->displacement_nodes())
    away.block(0)(node.displacement[1]) = -0.1;
  away.compress(dealii::VectorOperation::insert);
  // What was closed is held until the first answer.
  pressed.assemble(away, false);
  contact.augment(pressed.state);
  pressed.assemble(away, true);
  BOOST_TEST(!contact.is_balanced(1e-9));
  BlockVector correction(pressed.residual);
  contact.correct(pressed.level, correction, [](BlockVector &, const BlockVector &) { BOOST_TEST(false); });
  pressed.assemble(away, false);
  BOOST_TEST(contact.is_balanced(1e-9));
  BOOST_TEST(correction.l2_norm() == 0.);
  Ledger<2> book;
  contact.book_work(pressed.level, 1., pressed.state.unknown.block(0), book);
  const auto start = block.center();
  contact.accept(Pressed<2>::dt);
  // Backward Euler, whose level this is.
  BOOST_TEST(std::abs(block.velocity()[1] + 10. * Pressed<2>::dt) <= 1e-12);
  BOOST_TEST(std::abs(block.center()[1] - start[1] + 10. * Pressed<2>::dt * Pressed<2>::dt) <= 1e-12);
  BOOST_TEST(std::abs(book.gravity_work - block.mass() * 10. * 10. * Pressed<2>::dt * Pressed<2>::dt) <=
             1e-12 * book.gravity_work);
}
