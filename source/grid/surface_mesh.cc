#include <peat/grid/surface_mesh.h>

#include <peat/grid/shape.h>

#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/mapping_cartesian.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/vector.h>

#include <algorithm>
#include <cmath>

namespace peat {
template <int dim>
SurfaceMesh<dim> surface_mesh(const Shape<dim> &shape)
{
  SurfaceMesh<dim> result;
  if (shape.append_facets(result))
    return result;

  constexpr double n_cells = dim == 2 ? 128. : 40.;
  const Bounds<dim> box = shape.bounds();
  double longest = 0.;
  for (unsigned int d = 0; d < dim; ++d)
    longest = std::max(longest, box.upper[d] - box.lower[d]);
  // No node lies on a side of the bounds, where the distance of a box would vanish on whole faces of cells.
  const double h = longest / n_cells;
  std::vector<unsigned int> repetitions;
  dealii::Point<dim> lower, upper;
  for (unsigned int d = 0; d < dim; ++d) {
    const double length = box.upper[d] - box.lower[d];
    repetitions.push_back(std::ceil(length / h) + 1);
    const double beyond = 0.5 * (repetitions[d] * h - length);
    lower[d] = box.lower[d] - beyond;
    upper[d] = box.upper[d] + beyond;
  }
  dealii::Triangulation<dim> cells;
  dealii::GridGenerator::subdivided_hyper_rectangle(cells, repetitions, lower, upper);
  const dealii::FE_Q<dim> element(1);
  dealii::DoFHandler<dim> nodes(cells);
  nodes.distribute_dofs(element);
  dealii::Vector<double> distance(nodes.n_dofs());
  std::vector<dealii::types::global_dof_index> corners(element.n_dofs_per_cell());
  for (const auto &cell : nodes.active_cell_iterators()) {
    cell->get_dof_indices(corners);
    for (const unsigned int v : cell->vertex_indices())
      distance[corners[v]] = shape.distance(cell->vertex(v));
  }

  std::vector<dealii::CellData<dim - 1>> facets;
  const dealii::MappingCartesian<dim> mapping;
  dealii::GridTools::MarchingCubeAlgorithm<dim, dealii::Vector<double>>(mapping, element)
      .process(nodes, distance, 0., result.vertices, facets);
  for (const auto &facet : facets) {
    typename SurfaceMesh<dim>::Facet corners_of_facet;
    std::copy_n(facet.vertices.begin(), dim, corners_of_facet.begin());
    result.facets.push_back(corners_of_facet);
  }
  return result;
}

template SurfaceMesh<2> surface_mesh<2>(const Shape<2> &);
template SurfaceMesh<3> surface_mesh<3>(const Shape<3> &);
} // namespace peat
