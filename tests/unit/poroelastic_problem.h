#pragma once

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/distributed/tria.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_cartesian.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/lac/full_matrix.h>
#include <deal.II/lac/trilinos_block_sparse_matrix.h>
#include <deal.II/lac/trilinos_parallel_block_vector.h>
#include <deal.II/lac/trilinos_sparsity_pattern.h>

#include <peat/solver/linear_solver.h>

#include <cmath>
#include <vector>

/// One linear system of poroelasticity on the unit square or cube of sand, as a step of an implicit scheme
/// has it: rollers at sides and bottom, a load of 1e5 Pa on a drained top. One cell matrix serves all cells.
struct PoroelasticCase
{
  unsigned int n_cells = 8; ///< per direction
  unsigned int degree = 2;  ///< of the displacement
  double young = 1e7;       ///< [Pa]
  double poisson = 0.3;
  double conductivity = 1e-4; ///< k [m/s]
  double dt = 1e-3;           ///< [s]
  bool dynamic = false;
  bool seepage_inertia = false; ///< the block G
  bool saturated = true;
  bool half_load = false; ///< on x < 1/2 only; the rest of the top is free
  bool drained_top = true;
  bool projected = false; ///< the volumetric part acts on the projection of div u on P1 of each cell
  double sliver = 1.;     ///< factor on the matrices of the top row of cells, as a cut cell has it
};

template <int dim>
class PoroelasticProblem
{
public:
  using Indices = std::vector<dealii::types::global_dof_index>;

  PoroelasticProblem(const PoroelasticCase &setting, MPI_Comm communicator)
      : setting(setting), communicator(communicator), tria(communicator),
        u_element(dealii::FE_Q<dim>(setting.degree), dim), p_element(1), u_dofs(tria), p_dofs(tria)
  {
    dealii::GridGenerator::subdivided_hyper_cube(tria, setting.n_cells, 0., 1., true);
    u_dofs.distribute_dofs(u_element);
    p_dofs.distribute_dofs(p_element);
    make_cell_matrices();
    make_patterns();
    assemble();
  }

  const PoroelasticCase setting;
  MPI_Comm communicator;
  dealii::parallel::distributed::Triangulation<dim> tria;
  dealii::MappingCartesian<dim> mapping;
  dealii::FESystem<dim> u_element;
  dealii::FE_Q<dim> p_element;
  dealii::DoFHandler<dim> u_dofs, p_dofs;

  dealii::TrilinosWrappers::BlockSparseMatrix matrix;
  dealii::TrilinosWrappers::MPI::BlockVector rhs;
  dealii::TrilinosWrappers::SparseMatrix
      pressure_mass;                             ///< int c_k^2 alpha^2/(c_k (lambda + 2 mu/dim)) N_p N_p
  dealii::TrilinosWrappers::MPI::Vector inertia; ///< lumped c_a M, see peat::PreconditionerData

  dealii::TrilinosWrappers::SparseMatrix shear, gradient,
      projection; ///< see peat::PreconditionerData; only if `projected`
  dealii::TrilinosWrappers::MPI::Vector volumetric_compliance, shear_compliance;

  peat::PreconditionerData data() const
  {
    peat::PreconditionerData result;
    if (setting.saturated)
      result.pressure_mass = &pressure_mass;
    if (setting.dynamic)
      result.inertia = &inertia;
    if (setting.projected) {
      result.shear = &shear;
      result.gradient = &gradient;
      result.volumetric_compliance = &volumetric_compliance;
      result.shear_compliance = &shear_compliance;
      if (setting.saturated)
        result.projection = &projection;
      result.n_psi_per_cell = dim + 1;
    }
    return result;
  }

  peat::DisplacementUnknowns unknowns() const
  {
    const dealii::IndexSet owned = u_dofs.locally_owned_dofs();
    peat::DisplacementUnknowns result;
    result.dim = dim;
    result.positions.resize(owned.n_elements());
    result.components.resize(owned.n_elements());
    result.fixed.resize(owned.n_elements());
    Indices indices(u_element.n_dofs_per_cell());
    for (const auto &cell : u_dofs.active_cell_iterators())
      if (!cell->is_artificial()) {
        cell->get_dof_indices(indices);
        for (unsigned int i = 0; i < indices.size(); ++i)
          if (owned.is_element(indices[i])) {
            const auto k = owned.index_within_set(indices[i]);
            const dealii::Point<dim> x =
                mapping.transform_unit_to_real_cell(cell, u_element.unit_support_point(i));
            for (unsigned int d = 0; d < dim; ++d)
              result.positions[k][d] = x[d];
            result.components[k] = u_element.system_to_component_index(i).first;
            result.fixed[k] = u_fixed[indices[i]];
          }
      }
    return result;
  }

private:
  using Matrix = dealii::FullMatrix<double>;

  void make_cell_matrices()
  {
    const dealii::QGauss<dim> quadrature(setting.degree + 1);
    dealii::FEValues<dim> u_values(mapping, u_element, quadrature,
                                   dealii::update_values | dealii::update_gradients |
                                       dealii::update_JxW_values);
    dealii::FEValues<dim> p_values(mapping, p_element, quadrature,
                                   dealii::update_values | dealii::update_gradients);
    const double mu = setting.young / (2. * (1. + setting.poisson));
    const double lambda = 2. * mu * setting.poisson / (1. - 2. * setting.poisson);
    const double bulk = lambda + 2. * mu / dim;
    const double rho = 1990., rho_f = 1000., Q = 5.5e9, kappa = setting.conductivity / 9810.;
    c_a = setting.dynamic ? 4. / (setting.dt * setting.dt) : 0.;
    const double c_v = setting.dynamic ? 2. / setting.dt : 1. / setting.dt;
    const double p_scale = 1. / c_v; // of all p rows, and the sign that makes the matrix symmetric
    const unsigned int nu = u_element.n_dofs_per_cell(), np = p_element.n_dofs_per_cell();
    A.reinit(nu, nu);
    B.reinit(nu, np);
    C.reinit(np, nu);
    D.reinit(np, np);
    Mp.reinit(np, np);
    G.reinit(nu, dim + 1);
    mass_diagonal.assign(nu, 0.);
    // All ranks need one cell, and any has one or can do without.
    for (const auto &cell : u_dofs.active_cell_iterators())
      if (!cell->is_artificial()) {
        u_values.reinit(cell);
        break;
      }
    for (const auto &cell : p_dofs.active_cell_iterators())
      if (!cell->is_artificial()) {
        p_values.reinit(cell);
        break;
      }
    const dealii::FEValuesExtractors::Vector u(0);
    for (unsigned int q = 0; q < quadrature.size(); ++q) {
      const double w = u_values.JxW(q);
      for (unsigned int i = 0; i < nu; ++i) {
        const auto eps_i = u_values[u].symmetric_gradient(i, q);
        const auto v_i = u_values[u].value(i, q);
        const double div_i = u_values[u].divergence(i, q);
        for (unsigned int j = 0; j < nu; ++j)
          A(i, j) += w * (2. * mu * (eps_i * u_values[u].symmetric_gradient(j, q)) +
                          (setting.projected ? 0. : lambda * div_i * u_values[u].divergence(j, q)) +
                          c_a * rho * (v_i * u_values[u].value(j, q)));
        // 1.25 per direction for Q2, 1.5 for Q1: then they add up to the mass.
        mass_diagonal[i] += w * c_a * rho * (v_i * v_i) * std::pow(setting.degree == 2 ? 1.25 : 1.5, dim);
        for (unsigned int k = 0; k <= dim; ++k)
          G(i, k) += w * div_i * (k == 0 ? 1. : std::sqrt(12.) * (quadrature.point(q)[k - 1] - 0.5));
        for (unsigned int j = 0; j < np; ++j) {
          B(i, j) -= w * div_i * p_values.shape_value(j, q);
          C(j, i) -= w * div_i * p_values.shape_value(j, q);
          if (setting.seepage_inertia)
            C(j, i) -= w * p_scale * c_a * kappa * rho_f * (p_values.shape_grad(j, q) * v_i);
        }
      }
      for (unsigned int i = 0; i < np; ++i)
        for (unsigned int j = 0; j < np; ++j) {
          const double mass = w * p_values.shape_value(i, q) * p_values.shape_value(j, q);
          D(i, j) -= p_scale *
                     (c_v * mass / Q + w * kappa * (p_values.shape_grad(i, q) * p_values.shape_grad(j, q)));
          Mp(i, j) += mass / bulk;
        }
    }
    const double volume = std::pow(1. / setting.n_cells, dim);
    volumetric = volume / lambda;
    shearing = volume / (2. * mu);
    correct_pressure_mass(p_values, u_values, quadrature, mu, bulk, volume);
    A_shear = A;
    if (setting.projected)
      for (unsigned int i = 0; i < nu; ++i)
        for (unsigned int j = 0; j < nu; ++j)
          for (unsigned int k = 0; k <= dim; ++k)
            A(i, j) += lambda / volume * G(i, k) * G(j, k);
  }

  /// The part of N_p that the projection of div u does not see meets no volumetric stiffness.
  void correct_pressure_mass(const dealii::FEValues<dim> &p_values, const dealii::FEValues<dim> &weights,
                             const dealii::Quadrature<dim> &quadrature, const double mu, const double bulk,
                             const double volume)
  {
    if (!setting.projected)
      return;
    const unsigned int np = p_element.n_dofs_per_cell();
    moments.reinit(dim + 1, np);
    for (unsigned int q = 0; q < quadrature.size(); ++q)
      for (unsigned int i = 0; i < np; ++i)
        for (unsigned int k = 0; k <= dim; ++k)
          moments(k, i) += 1. / volume * weights.JxW(q) * p_values.shape_value(i, q) *
                           (k == 0 ? 1. : std::sqrt(12.) * (quadrature.point(q)[k - 1] - 0.5));
    for (unsigned int i = 0; i < np; ++i)
      for (unsigned int j = 0; j < np; ++j) {
        double projected = 0.;
        for (unsigned int k = 0; k <= dim; ++k)
          projected += moments(k, i) * moments(k, j) * volume;
        Mp(i, j) = projected / bulk + (Mp(i, j) * bulk - projected) / (2. * mu);
      }
  }

  void make_patterns()
  {
    using dealii::DoFTools::extract_locally_relevant_dofs;
    const dealii::IndexSet u_owned = u_dofs.locally_owned_dofs(), p_owned = p_dofs.locally_owned_dofs();
    dealii::IndexSet u_relevant, p_relevant;
    extract_locally_relevant_dofs(u_dofs, u_relevant);
    extract_locally_relevant_dofs(p_dofs, p_relevant);
    using Pattern = dealii::TrilinosWrappers::SparsityPattern;
    Pattern uu(u_owned, u_owned, u_relevant, communicator), up(u_owned, p_owned, u_relevant, communicator),
        pu(p_owned, u_owned, p_relevant, communicator), pp(p_owned, p_owned, p_relevant, communicator);
    const dealii::IndexSet psi_owned = cellwise();
    Pattern u_psi(u_owned, psi_owned, u_relevant, communicator), psi_p(psi_owned, p_owned, communicator);
    for_cells([&](const Indices &iu, const Indices &ip, const Indices &ipsi, const bool) {
      for (const auto row : iu) {
        uu.add_entries(row, iu.begin(), iu.end());
        up.add_entries(row, ip.begin(), ip.end());
        u_psi.add_entries(row, ipsi.begin(), ipsi.end());
      }
      for (const auto row : ipsi)
        psi_p.add_entries(row, ip.begin(), ip.end());
      for (const auto row : ip) {
        pu.add_entries(row, iu.begin(), iu.end());
        pp.add_entries(row, ip.begin(), ip.end());
      }
    });
    for (Pattern *pattern : {&uu, &up, &pu, &pp, &u_psi, &psi_p})
      pattern->compress();
    const unsigned int n_blocks = setting.saturated ? 2 : 1;
    matrix.reinit(n_blocks, n_blocks);
    matrix.block(0, 0).reinit(uu);
    std::vector<dealii::IndexSet> owned{u_owned};
    if (setting.saturated) {
      matrix.block(0, 1).reinit(up);
      matrix.block(1, 0).reinit(pu);
      matrix.block(1, 1).reinit(pp);
      pressure_mass.reinit(pp);
      owned.push_back(p_owned);
    }
    matrix.collect_sizes();
    rhs.reinit(owned, communicator);
    inertia.reinit(u_owned, communicator);
    if (setting.projected) {
      shear.reinit(uu);
      gradient.reinit(u_psi);
      projection.reinit(psi_p);
      volumetric_compliance.reinit(psi_owned, communicator);
      shear_compliance.reinit(psi_owned, communicator);
    }
  }

  /// Unknowns of dim + 1 functions on each owned cell.
  dealii::IndexSet cellwise() const
  {
    dealii::IndexSet result(tria.n_global_active_cells() * (dim + 1));
    for (const auto &cell : tria.active_cell_iterators())
      if (cell->is_locally_owned())
        result.add_range(cell->global_active_cell_index() * (dim + 1),
                         (cell->global_active_cell_index() + 1) * (dim + 1));
    result.compress();
    return result;
  }

  template <typename Visit>
  void for_cells(const Visit &visit)
  {
    Indices iu(u_element.n_dofs_per_cell()), ip(p_element.n_dofs_per_cell()), ipsi(dim + 1);
    auto p_cell = p_dofs.begin_active();
    for (auto cell = u_dofs.begin_active(); cell != u_dofs.end(); ++cell, ++p_cell)
      if (cell->is_locally_owned()) {
        cell->get_dof_indices(iu);
        p_cell->get_dof_indices(ip);
        for (unsigned int k = 0; k <= dim; ++k)
          ipsi[k] = cell->global_active_cell_index() * (dim + 1) + k;
        visit(iu, ip, ipsi, cell->face(2 * dim - 1)->at_boundary());
      }
  }

  static void add(dealii::TrilinosWrappers::SparseMatrix &target, const Matrix &local, const Indices &rows,
                  const std::vector<bool> &fixed_rows, const Indices &columns,
                  const std::vector<bool> &fixed_columns, const double factor, const bool diagonal)
  {
    std::vector<double> values(columns.size());
    for (unsigned int i = 0; i < rows.size(); ++i) {
      for (unsigned int j = 0; j < columns.size(); ++j) {
        const bool fixed = fixed_rows[rows[i]] || fixed_columns[columns[j]];
        values[j] = !fixed || (diagonal && i == j) ? factor * local(i, j) : 0.;
      }
      target.add(rows[i], columns.size(), columns.data(), values.data(), false);
    }
  }

  void find_fixed()
  {
    // Every rank keeps all dofs: these are small problems.
    u_fixed.assign(u_dofs.n_dofs(), false);
    p_fixed.assign(p_dofs.n_dofs(), false);
    Indices on_face(u_element.n_dofs_per_face()), p_on_face(p_element.n_dofs_per_face());
    auto p_cell = p_dofs.begin_active();
    for (auto cell = u_dofs.begin_active(); cell != u_dofs.end(); ++cell, ++p_cell)
      if (!cell->is_artificial())
        for (unsigned int f = 0; f < 2 * dim; ++f)
          if (cell->at_boundary(f)) {
            cell->face(f)->get_dof_indices(on_face);
            p_cell->face(f)->get_dof_indices(p_on_face);
            if (f == 2 * dim - 1 && setting.drained_top)
              for (const auto i : p_on_face)
                p_fixed[i] = true;
            if (f != 2 * dim - 1)
              for (unsigned int i = 0; i < on_face.size(); ++i)
                if (u_element.face_system_to_component_index(i).first == f / 2)
                  u_fixed[on_face[i]] = true;
          }
  }

  void assemble()
  {
    find_fixed();
    const std::vector<bool> psi_free(tria.n_global_active_cells() * (dim + 1), false);
    for_cells([&](const Indices &iu, const Indices &ip, const Indices &ipsi, const bool at_top) {
      const double factor = at_top ? setting.sliver : 1.;
      add(matrix.block(0, 0), A, iu, u_fixed, iu, u_fixed, factor, true);
      for (unsigned int i = 0; i < iu.size(); ++i)
        inertia(iu[i]) += factor * mass_diagonal[i];
      if (setting.projected) {
        add(shear, A_shear, iu, u_fixed, iu, u_fixed, factor, true);
        add(gradient, G, iu, u_fixed, ipsi, psi_free, factor, false);
        add(projection, moments, ipsi, psi_free, ip, p_fixed, 1., false);
        for (const auto k : ipsi) {
          volumetric_compliance(k) += factor * volumetric;
          shear_compliance(k) += factor * shearing;
        }
      }
      if (setting.saturated) {
        add(matrix.block(0, 1), B, iu, u_fixed, ip, p_fixed, factor, false);
        add(matrix.block(1, 0), C, ip, p_fixed, iu, u_fixed, factor, false);
        add(matrix.block(1, 1), D, ip, p_fixed, ip, p_fixed, factor, true);
        add(pressure_mass, Mp, ip, p_fixed, ip, p_fixed, factor, true);
      }
    });
    load_top();
    matrix.compress(dealii::VectorOperation::add);
    if (setting.saturated)
      pressure_mass.compress(dealii::VectorOperation::add);
    inertia.compress(dealii::VectorOperation::add);
    if (setting.projected) {
      shear.compress(dealii::VectorOperation::add);
      gradient.compress(dealii::VectorOperation::add);
      projection.compress(dealii::VectorOperation::add);
      volumetric_compliance.compress(dealii::VectorOperation::add);
      shear_compliance.compress(dealii::VectorOperation::add);
    }
    rhs.compress(dealii::VectorOperation::add);
  }

  void load_top()
  {
    const dealii::QGauss<dim - 1> quadrature(setting.degree + 1);
    dealii::FEFaceValues<dim> values(mapping, u_element, quadrature,
                                     dealii::update_values | dealii::update_JxW_values);
    Indices indices(u_element.n_dofs_per_cell());
    for (const auto &cell : u_dofs.active_cell_iterators())
      if (cell->is_locally_owned() && cell->face(2 * dim - 1)->at_boundary() &&
          !(setting.half_load && cell->center()[0] > 0.5)) {
        values.reinit(cell, 2 * dim - 1);
        cell->get_dof_indices(indices);
        for (unsigned int i = 0; i < indices.size(); ++i)
          if (u_element.system_to_component_index(i).first == dim - 1 && !u_fixed[indices[i]])
            for (unsigned int q = 0; q < quadrature.size(); ++q)
              rhs.block(0)(indices[i]) -= 1e5 * values.shape_value(i, q) * values.JxW(q);
      }
  }

  double c_a, volumetric, shearing;
  Matrix A, A_shear, B, C, D, Mp, G, moments;
  std::vector<double> mass_diagonal;
  std::vector<bool> u_fixed, p_fixed;
};
