#include "linear_preconditioner.h"
#include "persist_algebra.h"

#include <peat/base/error.h>

#include <deal.II/base/mpi.h>

#include <EpetraExt_MatrixMatrix.h>
#include <Epetra_Import.h>
#include <Teuchos_ParameterList.hpp>
#include <ml_MultiLevelPreconditioner.h>
#include <ml_utils.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace peat {
using BlockMatrix = LinearSolver::BlockMatrix;
using BlockVector = LinearSolver::BlockVector;

namespace {
Teuchos::ParameterList multigrid_settings()
{
  Teuchos::ParameterList list;
  ML_Epetra::SetDefaults("SA", list);
  list.set("ML output", 0);
  list.set("aggregation: type", "Uncoupled");
  list.set("smoother: type", "Chebyshev");
  list.set("prec type",
           "MGW"); // costs little more than a V and keeps iterations from growing with the levels
  list.set("smoother: sweeps", 4);
  list.set("coarse: type", "Amesos-KLU");
  list.set("coarse: max size", 2000);
  return list;
}

/// a A + b B for matrices of different patterns but the same maps.
void add_scaled(TrilinosMatrix &result, const TrilinosMatrix &A, const double a, const TrilinosMatrix &B,
                const double b)
{
  Epetra_CrsMatrix *total = nullptr;
  EpetraExt::MatrixMatrix::Add(A.trilinos_matrix(), false, a, B.trilinos_matrix(), false, b, total);
  const std::unique_ptr<Epetra_CrsMatrix> owner(total);
  total->FillComplete(A.trilinos_matrix().DomainMap(), A.trilinos_matrix().RangeMap());
  result.reinit(*total);
}

/// Constrained rows hold a diagonal of any sign: multigrid wants it positive.
void make_diagonal_positive(TrilinosMatrix &matrix)
{
  const TrilinosVector diagonal = absolute_diagonal(matrix);
  const auto range = matrix.local_range();
  for (auto row = range.first; row < range.second; ++row)
    matrix.set(row, row, diagonal(row));
  matrix.compress(dealii::VectorOperation::insert);
}

/// target -= matrix * vector
void subtract(TrilinosVector &target, const TrilinosMatrix &matrix, TrilinosVector &vector)
{
  vector *= -1.;
  matrix.vmult_add(target, vector);
  vector *= -1.;
}

TrilinosVector inverse(const TrilinosVector &vector)
{
  TrilinosVector result(vector);
  for (unsigned int i = 0; i < result.locally_owned_size(); ++i)
    result.trilinos_vector()[0][i] = 1. / vector.trilinos_vector()[0][i];
  return result;
}
} // namespace

TrilinosVector absolute_diagonal(const TrilinosMatrix &matrix)
{
  TrilinosVector result(matrix.locally_owned_range_indices(), matrix.get_mpi_communicator());
  Epetra_Vector diagonal(matrix.trilinos_matrix().RowMap());
  matrix.trilinos_matrix().ExtractDiagonalCopy(diagonal);
  for (int i = 0; i < diagonal.MyLength(); ++i)
    result.trilinos_vector()[0][i] = diagonal[i] == 0. ? 1. : std::abs(diagonal[i]);
  return result;
}

TrilinosVector diagonal_of_product(const TrilinosMatrix &C, const TrilinosVector &diagonal_of_A)
{
  const Epetra_CrsMatrix &matrix = C.trilinos_matrix();
  Epetra_Vector of_columns(matrix.ColMap());
  if (matrix.Importer())
    of_columns.Import(diagonal_of_A.trilinos_vector(), *matrix.Importer(), Insert);
  else
    of_columns = *diagonal_of_A.trilinos_vector()(0);
  TrilinosVector result(C.locally_owned_range_indices(), C.get_mpi_communicator());
  for (int row = 0; row < matrix.NumMyRows(); ++row) {
    int length, *columns;
    double *values, total = 0.;
    matrix.ExtractMyRowView(row, length, values, columns);
    for (int k = 0; k < length; ++k)
      total += values[k] * values[k] / of_columns[columns[k]];
    result.trilinos_vector()[0][row] = total;
  }
  return result;
}

std::vector<double> rigid_body_modes(const DisplacementUnknowns &unknowns)
{
  const unsigned int dim = unknowns.dim, n_rotations = dim == 2 ? 1 : 3;
  const std::size_t n = unknowns.positions.size();
  dealii::Point<3> middle;
  for (const auto &x : unknowns.positions)
    middle += (x - dealii::Point<3>()) / double(n);
  std::vector<double> modes((dim + n_rotations) * n, 0.);
  for (std::size_t i = 0; i < n; ++i) {
    if (!unknowns.fixed.empty() && unknowns.fixed[i])
      continue;
    const auto x = unknowns.positions[i] - middle;
    const unsigned int component = unknowns.components[i];
    modes[component * n + i] = 1.;
    for (unsigned int r = 0; r < n_rotations; ++r) {
      const unsigned int axis = dim == 2 ? 2 : r, first = (axis + 1) % 3, second = (axis + 2) % 3;
      if (component == first)
        modes[(dim + r) * n + i] = -x[second];
      else if (component == second)
        modes[(dim + r) * n + i] = x[first];
    }
  }
  return modes;
}

void Multigrid::build(TrilinosMatrix &matrix, const unsigned int n_components)
{
  factor = 1. / absolute_diagonal(matrix).linfty_norm();
  matrix *= factor;
  make(matrix, n_components);
}

void Multigrid::make(const TrilinosMatrix &matrix, const unsigned int n_components)
{
  Teuchos::ParameterList list = multigrid_settings();
  list.set("PDE equations", int(n_components));
  ML_set_random_seed(multigrid_seed);
  amg.initialize(matrix, list);
}

void Multigrid::persist(Archive &archive, TrilinosMatrix &matrix, const unsigned int n_components)
{
  archive(factor);
  if (archive.is_loading())
    amg.clear(); // goes before its matrix
  persist_rows(archive, matrix);
  if (archive.is_loading())
    make(matrix, n_components);
}

std::vector<std::vector<double>> lattice_places(const DisplacementUnknowns &unknowns, MPI_Comm communicator)
{
  std::vector<std::vector<double>> places(unknowns.dim);
  for (unsigned int d = 0; d < unknowns.dim; ++d) {
    std::set<double> mine;
    for (const auto &x : unknowns.positions)
      mine.insert(x[d]);
    std::vector<double> planes;
    for (const auto &of_rank :
         dealii::Utilities::MPI::all_gather(communicator, std::vector<double>(mine.begin(), mine.end())))
      planes.insert(planes.end(), of_rank.begin(), of_rank.end());
    std::sort(planes.begin(), planes.end());
    // Round-off apart.
    const double close = planes.empty() ? 0. : 1e-9 * (planes.back() - planes.front());
    planes.erase(std::unique(planes.begin(), planes.end(),
                             [&](const double a, const double b) { return b - a <= close; }),
                 planes.end());
    for (std::size_t i = 0; i < unknowns.positions.size(); i += unknowns.dim)
      places[d].push_back(std::upper_bound(planes.begin(), planes.end(), unknowns.positions[i][d] + close) -
                          planes.begin());
  }
  return places;
}

namespace {
/// The largest sum of 1 / distance^2 over the nodes that a node is coupled with.
double largest_closeness(const TrilinosMatrix &stiffness, const std::vector<std::vector<double>> &places)
{
  const Epetra_CrsMatrix &matrix = stiffness.trilinos_matrix();
  const int dim = places.size();
  double largest = 0.;
  for (int row = 0; row < matrix.NumMyRows(); row += dim) {
    int length, *columns;
    double *values, sum = 0.;
    matrix.ExtractMyRowView(row, length, values, columns);
    for (int k = 0; k < length; ++k) {
      const int other = matrix.LRID(matrix.GCID64(columns[k]));
      if (other < 0 || other % dim != 0 || other == row)
        continue;
      double distance = 0.;
      for (const auto &place : places)
        distance += std::pow(place[other / dim] - place[row / dim], 2);
      // Beyond what functions reach there are only those that are tied to something.
      constexpr double farthest = 3.;
      if (distance <= dim * farthest * farthest)
        sum += 1. / distance;
    }
    largest = std::max(largest, sum);
  }
  double over_ranks = 0.;
  matrix.Comm().MaxAll(&largest, &over_ranks, 1);
  return over_ranks;
}
} // namespace

void Multigrid::build(const TrilinosMatrix &matrix, const std::vector<double> &modes,
                      const std::vector<std::vector<double>> &places)
{
  const unsigned int dim = places.size();
  Teuchos::ParameterList list = multigrid_settings();
  list.set("PDE equations", int(dim));
  list.set("null space: type", "pre-computed");
  list.set("null space: add default vectors", false);
  list.set("null space: dimension", int(dim == 2 ? 3 : 6));
  // ML takes plain pointers and only reads from them; a rank without unknowns still needs one.
  static double nothing = 0.;
  const auto pointer = [](const std::vector<double> &values) {
    return values.empty() ? &nothing : const_cast<double *>(values.data());
  };
  list.set("null space: vectors", pointer(modes));
  // Nodes of Q2 or of GIMP are coupled with up to 124 or 342 others, and aggregates of a node and all of
  // these are too large: iterations then grow with the mesh. Here they are made of neighbours on the lattice
  // of nodes alone. ML keeps what is closer than a share of the closeness of all others: between diagonals
  // and every second node.
  // What it drops it adds to the diagonal when it estimates the largest eigenvalue, which may then be far
  // off, where there is much inertia above all. So the smoother must do without it: two sweeps forth and back
  // cost as much as a Chebyshev polynomial of fourth degree.
  const double closeness = largest_closeness(matrix, places);
  if (closeness > 0.) {
    list.set("smoother: type", "symmetric Gauss-Seidel");
    list.set("smoother: sweeps", 2);
    list.set("aggregation: aux: enable", true);
    list.set("aggregation: aux: max levels", 1);
    list.set("aggregation: aux: threshold", 1. / (2. * std::sqrt(double(dim)) * closeness));
    const char *names[] = {"x-coordinates", "y-coordinates", "z-coordinates"};
    for (unsigned int d = 0; d < dim; ++d)
      list.set(names[d], pointer(places[d]));
  }
  ML_set_random_seed(multigrid_seed);
  amg.initialize(matrix, list);
}

void Multigrid::vmult(TrilinosVector &result, const TrilinosVector &source) const
{
  amg.vmult(result, source);
  if (factor != 1.)
    result *= factor;
}

void SchurInverse::build(const BlockMatrix &matrix, const PreconditionerData &data)
{
  const TrilinosMatrix &D = matrix.block(1, 1);
  if (data.pressure_mass)
    add_scaled(stiff, *data.pressure_mass, 1., D, -1.);
  else {
    stiff.copy_from(D);
    stiff *= -1.;
  }
  make_diagonal_positive(stiff);
  stiff_inverse.build(stiff, 1);
  has_inertia = data.inertia != nullptr;
  if (has_inertia) {
    TrilinosMatrix product;
    matrix.block(1, 0).mmult(product, matrix.block(0, 1), inverse(*data.inertia));
    add_scaled(inert, product, 1., D, -1.);
    make_diagonal_positive(inert);
    inert_inverse.build(inert, 1);
  }
  scratch.reinit(stiff.locally_owned_range_indices(), stiff.get_mpi_communicator());
}

void SchurInverse::persist(Archive &archive)
{
  stiff_inverse.persist(archive, stiff, 1);
  if (has_inertia)
    inert_inverse.persist(archive, inert, 1);
}

void SchurInverse::vmult(TrilinosVector &result, const TrilinosVector &source) const
{
  stiff_inverse.vmult(result, source);
  if (has_inertia) {
    inert_inverse.vmult(scratch, source);
    result += scratch;
  }
}

void BlockOperator::vmult(BlockVector &result, const BlockVector &source) const
{
  if (!data.shear) {
    matrix.vmult(result, source);
    return;
  }
  const unsigned int last = source.n_blocks() - 1;
  data.shear->vmult(result.block(0), source.block(0));
  if (last == 2) {
    matrix.block(0, 1).vmult_add(result.block(0), source.block(1));
    matrix.block(1, 0).vmult(result.block(1), source.block(0));
    matrix.block(1, 1).vmult_add(result.block(1), source.block(1));
  }
  data.gradient->vmult_add(result.block(0), source.block(last));
  // G^T u - W pi
  result.block(last) = source.block(last);
  result.block(last).scale(*data.volumetric_compliance);
  result.block(last) *= -1.;
  data.gradient->Tvmult_add(result.block(last), source.block(0));
}

void VolumetricInverse::build(const PreconditionerData &data)
{
  const TrilinosVector &W = *data.volumetric_compliance, &F = *data.shear_compliance;
  scratch = W;
  scratch += F;
  stiff_inverse = inverse(scratch);
  has_inertia = data.inertia != nullptr;
  if (!has_inertia)
    return;
  share = F;
  share.scale(stiff_inverse);
  data.gradient->Tmmult(inert, *data.gradient, inverse(*data.inertia));
  const auto range = inert.local_range();
  for (auto row = range.first; row < range.second; ++row)
    inert.add(row, row, W(row) * share(row));
  inert.compress(dealii::VectorOperation::add);
  inert_inverse.build(inert, data.n_psi_per_cell);
}

void VolumetricInverse::persist(Archive &archive, const PreconditionerData &data)
{
  persist_values(archive, stiff_inverse);
  if (!has_inertia)
    return;
  persist_values(archive, share);
  inert_inverse.persist(archive, inert, data.n_psi_per_cell);
}

void VolumetricInverse::vmult(TrilinosVector &result, const TrilinosVector &source) const
{
  if (has_inertia) {
    scratch = source;
    scratch.scale(share);
    inert_inverse.vmult(result, scratch);
    result.scale(share);
    scratch = source;
    scratch.scale(stiff_inverse);
    result += scratch;
  } else {
    result = source;
    result.scale(stiff_inverse);
  }
}

BlockPreconditioner::BlockPreconditioner(const DisplacementUnknowns &unknowns)
    : unknowns(unknowns), modes(rigid_body_modes(unknowns))
{}

void BlockPreconditioner::build(const BlockMatrix &new_matrix, const PreconditionerData &new_data)
{
  matrix = &new_matrix;
  data = new_data;
  if (places.empty())
    places = lattice_places(unknowns, matrix->get_mpi_communicator());
  displacement.build(stiffness(), modes, places);
  values.clear();
  for_each_row(stiffness().trilinos_matrix(),
               [&](const double *row, const int n) { values.insert(values.end(), row, row + n); });
  if (data.shear)
    volumetric.build(data);
  if (matrix->n_block_rows() == 2)
    schur.build(*matrix, data);
  if (data.projection) {
    p_scratch.reinit(matrix->block(1, 1).locally_owned_range_indices(), matrix->get_mpi_communicator());
    psi_scratch = projected = *data.volumetric_compliance;
  }
  u_scratch.reinit(stiffness().locally_owned_range_indices(), stiffness().get_mpi_communicator());
}

void BlockPreconditioner::persist(Archive &archive, const BlockMatrix &)
{
  archive(values);
  if (archive.is_loading()) {
    const double *next = values.data();
    for_each_row(stiffness().trilinos_matrix(), [&](double *row, const int n) {
      std::copy_n(next, n, row);
      next += n;
    });
    displacement.build(stiffness(), modes, places);
  }
  if (data.shear)
    volumetric.persist(archive, data);
  if (matrix->n_block_rows() == 2)
    schur.persist(archive);
}

void BlockPreconditioner::vmult(BlockVector &result, const BlockVector &source) const
{
  const bool has_pressure = matrix->n_block_rows() == 2, mixed = data.shear != nullptr;
  const unsigned int last = result.n_blocks() - 1;
  u_scratch = source.block(0);
  if (data.projection)
    solve_pressures(result, source);
  else {
    if (has_pressure) {
      schur.vmult(result.block(1), source.block(1));
      result.block(1) *= -1.;
    }
    if (mixed) {
      volumetric.vmult(result.block(last), source.block(last));
      result.block(last) *= -1.;
    }
  }
  // u = A^-1 (f_u - B p - G pi)
  if (has_pressure)
    subtract(u_scratch, matrix->block(0, 1), result.block(1));
  if (mixed)
    subtract(u_scratch, *data.gradient, result.block(last));
  displacement.vmult(result.block(0), u_scratch);
}

void BlockPreconditioner::solve_pressures(BlockVector &result, const BlockVector &source) const
{
  const TrilinosVector &f = source.block(2);
  TrilinosVector &p = result.block(1), &pi = result.block(2);
  // f_p + P^T (f_pi - W V f_pi)
  volumetric.vmult(pi, f);
  psi_scratch = pi;
  psi_scratch.scale(*data.volumetric_compliance);
  psi_scratch.sadd(-1., f);
  data.projection->Tvmult(p_scratch, psi_scratch);
  p_scratch += source.block(1);
  schur.vmult(p, p_scratch);
  p *= -1.;
  // pi = P p - V (f_pi + W P p)
  data.projection->vmult(projected, p);
  psi_scratch = projected;
  psi_scratch.scale(*data.volumetric_compliance);
  psi_scratch += f;
  volumetric.vmult(pi, psi_scratch);
  pi.sadd(-1., projected);
}
} // namespace peat
