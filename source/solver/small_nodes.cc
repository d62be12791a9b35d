#include <peat/solver/small_nodes.h>

namespace peat {
namespace {
/// A node is small with less than this share of the mass of those behind it; the edges and corners of a body
/// that fills its cells have a half.
constexpr double small_share = 0.1;
/// Of the stiffness and the inertia with which the material behind the node resists.
constexpr double strength = 1e-2;
} // namespace

template <int dim>
void SmallNodes<dim>::survey(const dealii::TrilinosWrappers::MPI::Vector &mass, const double speed)
{
  const double nothing = 1e-14 * mass.linfty_norm();
  without_mass.clear();
  for (const Index index : space.relevant()[0])
    if (mass(index) <= nothing)
      without_mass.push_back(index);
  links.clear();
  for_each_own_line([&](const Line &line) {
    const double own = mass(line.node[0]);
    const double behind = std::max(mass(line.node[1]), mass(line.node[2]));
    if (own <= nothing || own >= small_share * behind || mass(line.node[1]) <= nothing ||
        mass(line.node[2]) <= nothing)
      return;
    const double share = 1. - own / (small_share * behind);
    const double weight = strength * share * behind;
    links.push_back({line, weight * speed * speed / (line.near * line.near), weight});
  });
}

template <int dim>
void SmallNodes<dim>::assemble(const TimeLevel &level, const StepState &state,
                               const dealii::AffineConstraints<double> &constraints, BlockVector &residual,
                               BlockMatrix *matrix) const
{
  // A static state is to be one of the points' own equations.
  if (level.velocity == 0.)
    return;
  std::vector<Index> unknowns(3);
  dealii::FullMatrix<double> local(3, 3);
  for (const Link &link : links) {
    // The stiffness is nothing beside inertia where steps are short, and points hardly say how such a node
    // moves.
    const double resistance = link.stiffness * level.share + link.mass * level.acceleration;
    const double ratio = link.line.near / link.line.far;
    const std::array<double, 3> bend = {1., -1. - ratio, ratio};
    for (unsigned int d = 0; d < dim; ++d) {
      double off = 0.;
      for (unsigned int i = 0; i < 3; ++i) {
        unknowns[i] = link.line.node[i] + d;
        off += bend[i] * state.unknown.block(0)(unknowns[i]);
      }
      for (unsigned int i = 0; i < 3; ++i) {
        residual.block(0)(unknowns[i]) -= resistance * bend[i] * off;
        for (unsigned int j = 0; j < 3; ++j)
          local(i, j) = resistance * bend[i] * bend[j];
      }
      if (matrix)
        constraints.distribute_local_to_global(local, unknowns, *matrix);
    }
  }
}

template class SmallNodes<2>;
template class SmallNodes<3>;
} // namespace peat
