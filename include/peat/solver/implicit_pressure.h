#pragma once

#include <peat/condition/nodal_fields.h>
#include <peat/solver/nodal_coupling.h>
#include <peat/solver/node_extension.h>
#include <peat/transfer/kernels.h>

#include <deal.II/base/tensor.h>
#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/lac/trilinos_precondition.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>

#include <array>
#include <memory>
#include <vector>

namespace peat {
template <int dim>
class PressureSystem;

/// How a node answers to the pore pressure: which components may move and flow.
template <int dim>
struct NodeFreedom
{
  std::vector<char> moves; ///< [n_nodes * dim] no condition prescribes it
  std::vector<char> flows; ///< [n_nodes * dim] no condition closes it or gives the flux
  /// Nodes whose flux a tilted wall turns: the flux there is this times the unconstrained one.
  std::vector<std::pair<std::uint32_t, dealii::Tensor<2, dim>>> walls;
};

/// The pore pressure of a continuum in a semi-implicit step: one unknown per cell and body, the change Y of
/// its increment X against that of the last step, from
///
///   (S + B^T G B + C) Y = - dt B^T (alpha v_m + w) - (S + C) X_last,   B = sum V grad N,  S = sum V/Q,
///
/// where v_m and w are mid-step velocity and flux as an explicit step would have them, G what nodes make of
/// forces, alone or coupled with others, and C is the stabilisation (theory.md, implicit pore pressure).
/// Symmetric and positive definite. PressureSystem solves it, for all continua together; the preconditioner
/// is the diagonal, or algebraic multigrid on a star of 2 dim + 1 points.
///
/// A step calls begin(), then prepare() and, when the change is found, update() once or more often, then
/// finish(). Collective: all functions that a step calls.
template <int dim>
class ImplicitPressure
{
public:
  /// Of the change of the increment in the pressure that acts: 1/2 for the trapezoidal rule, and 1/16 more of
  /// the second difference in time, which damps what steps do not resolve.
  static constexpr double weight = 0.5 + 1. / 16.;

  /// @param response of the continuum's nodes; empty: nodes are not coupled with others
  /// @param stabilisation factor on the term that acts on alternating pressures
  /// @param extension of small nodes, or nullptr
  ImplicitPressure(const ActiveNodes<dim> &active, NodalResponse &response, double alpha,
                   bool seepage_inertia, double stabilisation, const NodeExtension<dim> *extension);

  /// Number the unknowns, one for each of these cells, in the order of the sums.
  void renumber(const std::vector<CellId> &cells);

  /// The increments are those of the last step.
  void begin();
  /// Make the system for a change of the increments, from the fields as they are.
  void prepare(const NodeFreedom<dim> &freedom, const dealii::Tensor<1, dim> &gravity,
               const NodalFields<dim> &nodal);
  /// Add what the change does to acceleration, new velocity, flux and the sums of forces. Of accelerations
  /// and velocities that is what nodes do alone: whatever couples them adds its part.
  void update(NodalFields<dim> &nodal);
  /// Find what flows and is squeezed out.
  void finish(const NodalFields<dim> &nodal);

  /// What the points bring, before begin().
  CellSums sums;
  /// Increments [Pa].
  const double *increments() const { return x.begin(); }
  /// Of the last step, in its middle, over this rank's cells [m^dim].
  double fluid_outflow() const { return outflow; }
  double fluid_squeezed() const { return squeezed; }
  unsigned long n_multigrids() const { return multigrids_made; }

  /// What the next step knows of those before; the unknowns are numbered.
  void persist(Archive &archive);

private:
  using Vector = dealii::LinearAlgebra::distributed::Vector<double>;
  static constexpr unsigned int n_corners = 1u << dim;
  /// Alternating pressures of the cells around a node: by the directions in which they alternate, two at
  /// least.
  static constexpr unsigned int n_modes = dim == 2 ? 1 : 4;
  static constexpr unsigned int mode_directions[4] = {3, 5, 6, 7};

  friend class PressureSystem<dim>;

  /// For the stabilisation: nodes whose cells are all of this rank, and corners at the others.
  /// @param around unknowns around each node [n_nodes][n_corners + 1]; -1: none
  /// @param before the first unknown of this rank
  void find_alternating(const std::vector<double> &around, double before);
  void find_responses(const NodeFreedom<dim> &freedom, const NodalFields<dim> &nodal);
  void find_mode_responses();
  void find_right_side(const dealii::Tensor<1, dim> &gravity, const NodalFields<dim> &nodal);
  void find_diagonal();
  /// Add a multiple of what it makes of these pressures.
  void add_stabilisation(const Vector &pressures, double factor, Vector &result) const;
  /// The matrix that multigrid is made for: the couplings over faces alone.
  void number_star();
  void fill_star();
  void make_multigrid();

  // For the solution.
  /// Squared, of this rank's entries, in the norm of the inverse diagonal.
  double squared_norm(const Vector &vector) const;
  /// q = B X, summed over ranks.
  void to_nodes(const Vector &pressures);
  /// What nodes make of q, each alone, in `response`.
  void find_accelerations_and_fluxes();
  /// The image of pressures from q, or from what coupled nodes make of it.
  void apply(const Vector &pressures, Vector &image);
  void precondition(const Vector &r, Vector &z) const;
  /// After so many iterations: is it worth while to have multigrid, or a new one?
  void judge_preconditioner(unsigned int n_iterations);

  const ActiveNodes<dim> &active;
  NodalResponse &response;
  const double alpha;
  const bool seepage_inertia;
  const double stabilisation;
  const NodeExtension<dim> *const extension;
  MPI_Comm communicator;

  std::vector<CellId> cell_of_unknown;
  std::vector<std::array<std::uint32_t, n_corners>> corner;
  /// Number, over all ranks, of the unknown on the other side of a face; -1: none.
  std::vector<std::array<double, 2 * dim>> neighbour;
  std::vector<char> unbroken; ///< by node: every cell around it has one unknown
  /// An unbroken node whose cells are all of this rank, and the unknowns around it.
  struct InnerNode
  {
    std::uint32_t node;
    std::array<std::uint32_t, n_corners> unknowns;
  };
  /// Where one of this rank's cells has an unbroken node that is not such.
  struct OuterCorner
  {
    std::uint32_t node, unknown, corner;
  };
  std::vector<InnerNode> inner;
  std::vector<OuterCorner> outer;
  std::vector<double> filling; ///< by node: part of its cells that have unknowns
  std::vector<double> spacing; ///< of the mesh at a node [n_nodes][dim]

  // How nodes answer to q = B X, rows with dim columns.
  double dt = 0.;
  std::vector<double> mobility;      ///< of the acceleration: weight alpha / m
  std::vector<double> conductance;   ///< of the flux
  std::vector<double> yield;         ///< G of nodes that are not coupled
  std::vector<double> seen_yield;    ///< about what points see of it
  std::vector<double> mode_response; ///< of alternating pressures, n_modes columns
  std::vector<std::pair<std::uint32_t, dealii::Tensor<2, dim>>> walls; ///< conductances there
  std::vector<double> q, carry, gross;
  mutable std::vector<double> mode;
  std::vector<dealii::Tensor<1, dim>> through_walls;

  Vector x, change, right_side, diagonal, r, z, direction, image;
  double round_off = 0.; ///< of this rank's right side, squared, in its norm
  double outflow = 0., squeezed = 0.;

  dealii::TrilinosWrappers::SparseMatrix star;
  std::unique_ptr<dealii::TrilinosWrappers::PreconditionAMG> multigrid;
  bool wants_multigrid = false;
  unsigned int fresh_iterations = 0; ///< of the first solve with this multigrid; 0: none yet
  unsigned long multigrids_made = 0;
};
} // namespace peat
