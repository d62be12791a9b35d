#include <peat/condition/condition.h>

#include <deal.II/base/mpi.h>

#include <algorithm>

#include "components.h"

// What a rigid plate does to the ground that it lies on: nodes move as one, under whatever acts on all of
// them together.

namespace peat {
namespace {
template <int dim>
class TiedNodes : public Condition<dim>
{
public:
  TiedNodes(Section section, const Place<dim> &place) : Condition<dim>(section, place)
  {
    std::vector<std::string> components;
    section.add("Components", components, axis_names<dim>(),
                "The components of the motion that all nodes have in common; the others stay free.");
    if (section.describing())
      return;
    if (!place.on_mesh())
      section.fail("Where", "nodes are tied on faces of the mesh or in a region, not on a body's surface; a "
                            "'Region' can hold the nodes that the surface runs through");
    section.require("Components", "condition '" + section.name() + "'");
    tied = named_components<dim>(section, components);
  }

  bool ties(const unsigned int component) const override { return tied[component]; }

  void select(const ActiveNodes<dim> &nodes) override
  {
    Condition<dim>::select(nodes);
    // Nodes on the edge between two faces count once.
    members.clear();
    for (const auto &selection : this->selections)
      members.insert(members.end(), selection.nodes.begin(), selection.nodes.end());
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
  }

  void tie(const ActiveNodes<dim> &nodes, const NodalFields<dim> &fields,
           std::vector<double> &motion) const override
  {
    // Momentum, and mass as the last.
    std::vector<double> sums(dim + 1, 0.);
    for (const std::uint32_t i : members) {
      if (!nodes.is_owned(i))
        continue;
      const double mass = fields.mass(i);
      for (unsigned int d = 0; d < dim; ++d)
        sums[d] += mass * motion[std::size_t(i) * dim + d];
      sums[dim] += mass;
    }
    dealii::Utilities::MPI::sum(sums, nodes.grid().communicator(), sums);
    if (!(sums[dim] > 0.))
      return;
    for (const std::uint32_t i : members)
      for (unsigned int d = 0; d < dim; ++d)
        if (tied[d])
          motion[std::size_t(i) * dim + d] = sums[d] / sums[dim];
  }

private:
  std::array<bool, dim> tied{};
  std::vector<std::uint32_t> members;
};
const ConditionMember<TiedNodes> tied_nodes(
    "tied", "the nodes move as one, as under a rigid plate that does not turn; of what acts on them the sum "
            "counts.");
} // namespace
} // namespace peat
