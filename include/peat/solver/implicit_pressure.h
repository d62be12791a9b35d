#pragma once

#include <peat/condition/nodal_fields.h>
#include <peat/transfer/kernels.h>

#include <deal.II/base/tensor.h>
#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/lac/trilinos_precondition.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>

#include <memory>
#include <vector>

namespace peat {
/// What implicit pressures cost so far.
struct PressureWork
{
  unsigned long solves = 0;
  unsigned long iterations = 0;
  unsigned long multigrids = 0; ///< preconditioners made
};

/// How a node answers to the pore pressure: which components may move and flow.
template <int dim>
struct NodeFreedom
{
  std::vector<char> moves; ///< [n_nodes * dim] no condition prescribes it
  std::vector<char> flows; ///< [n_nodes * dim] no condition closes it or gives the flux
  /// Nodes whose flux a tilted wall turns: the flux there is this times the unconstrained one.
  std::vector<std::pair<std::uint32_t, dealii::Tensor<2, dim>>> walls;
};

/// The pore pressure of a semi-implicit step: one unknown per cell and body, the change Y of its increment X
/// against that of the last step, from
///
///   (S + B^T G B + C) Y = - dt B^T (alpha v_m + w) - (S + C) X_last,   B = sum V grad N,  S = sum V/Q,
///
/// where v_m and w are mid-step velocity and flux as an explicit step would have them, and C is the
/// stabilisation (theory.md, implicit pore pressure). Symmetric and positive definite; solved by conjugate
/// gradients, with the diagonal, or with algebraic multigrid on a star of 2 dim + 1 points, as
/// preconditioner.
///
/// Collective: all functions that a step calls.
template <int dim>
class ImplicitPressure
{
public:
  /// Of the change of the increment in the pressure that acts: 1/2 for the trapezoidal rule, and 1/16 more of
  /// the second difference in time, which damps what steps do not resolve.
  static constexpr double weight = 0.5 + 1. / 16.;

  /// @param stabilisation factor on the term that acts on alternating pressures
  /// @param tolerance residual over right-hand side, in the norm of the inverse diagonal
  ImplicitPressure(const ActiveNodes<dim> &active, double alpha, bool seepage_inertia, double stabilisation,
                   double tolerance);

  /// Number the unknowns, one for each of these cells, in the order of the sums.
  void renumber(const std::vector<CellId> &cells);

  /// Find the increments, and add what they do to acceleration, new velocity, flux and the sums of forces.
  /// Throws NumericalError on every rank if they do not converge.
  void solve(const NodeFreedom<dim> &freedom, const dealii::Tensor<1, dim> &gravity, NodalFields<dim> &nodal);

  /// What the points bring, before solve().
  CellSums sums;
  /// Increments [Pa].
  const double *increments() const { return x.begin(); }
  /// Of the last step, in its middle, over this rank's cells [m^dim].
  double fluid_outflow() const { return outflow; }
  double fluid_squeezed() const { return squeezed; }
  const PressureWork &work() const { return done; }

private:
  using Vector = dealii::LinearAlgebra::distributed::Vector<double>;
  static constexpr unsigned int n_corners = 1u << dim;
  /// Alternating pressures of the cells around a node: by the directions in which they alternate, two at
  /// least.
  static constexpr unsigned int n_modes = dim == 2 ? 1 : 4;
  static constexpr unsigned int mode_directions[4] = {3, 5, 6, 7};

  void find_responses(const NodeFreedom<dim> &freedom, const NodalFields<dim> &nodal);
  void find_right_side(const dealii::Tensor<1, dim> &gravity, const NodalFields<dim> &nodal);
  /// q = B X, summed over ranks.
  void to_nodes(const Vector &pressures) const;
  void apply(const Vector &pressures, Vector &image) const;
  /// Add a multiple of what it makes of these pressures.
  void add_stabilisation(const Vector &pressures, double factor, Vector &result) const;
  void find_diagonal();
  void precondition(const Vector &r, Vector &z) const;
  void make_multigrid();
  unsigned int iterate();
  void update(NodalFields<dim> &nodal);

  const ActiveNodes<dim> &active;
  const double alpha;
  const bool seepage_inertia;
  const double stabilisation;
  const double tolerance;
  MPI_Comm communicator;

  std::vector<CellId> cell_of_unknown;
  std::vector<std::array<std::uint32_t, n_corners>> corner;
  /// Number, over all ranks, of the unknown on the other side of a face; -1: none.
  std::vector<std::array<double, 2 * dim>> neighbour;
  std::vector<char> unbroken;  ///< by node: every cell around it has one unknown
  std::vector<double> filling; ///< by node: part of its cells that have unknowns
  std::vector<double> spacing; ///< of the mesh at a node [n_nodes][dim]

  // How nodes answer to q = B X, rows with dim columns.
  double dt = 0.;
  std::vector<double> mobility;      ///< of the acceleration: weight alpha / m
  std::vector<double> conductance;   ///< of the flux
  std::vector<double> response;      ///< G
  std::vector<double> mode_response; ///< of alternating pressures, n_modes columns
  std::vector<std::pair<std::uint32_t, dealii::Tensor<2, dim>>> walls; ///< conductances there
  mutable std::vector<double> q, mode;

  Vector x, change, right_side, diagonal, r, z, direction, image;
  double round_off = 0.; ///< of the right side, in its norm
  double outflow = 0., squeezed = 0.;

  dealii::TrilinosWrappers::SparseMatrix star;
  std::unique_ptr<dealii::TrilinosWrappers::PreconditionAMG> multigrid;
  bool wants_multigrid = false;
  unsigned int fresh_iterations = 0; ///< of the first solve with this multigrid; 0: none yet
  PressureWork done;
};
} // namespace peat
