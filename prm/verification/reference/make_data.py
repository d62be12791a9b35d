#!/usr/bin/python3
"""Write the tables in data/ from the parameters in data/params.json and the exact solutions in exact/.

    python3 make_data.py [NAME ...]        e.g. make_data.py D3; without a name all tables

Needs numpy and scipy. The lines of a table that begin with # hold its parameters; the first other line the columns.
"""
import json
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, "exact"))
import bar_impact, bar_wave, column_selfweight, geostatic, hertz, incline, large_consolidation, mandel, patch_rigid
import porous_impact, stability, strip_box, terzaghi, two_layer, up_column, up_dispersion

DATA = os.path.join(HERE, "data")
UP = ("M", "K", "Q", "alpha", "rho", "rho_f")


def soil(d):
    """From moduli and densities of the constituents to the coefficients of the u-p equations."""
    E, nu, n = d["E"], d["nu"], d["n"]
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    storage = n / d["K_f"] + ((d["alpha"] - n) / d["K_s"] if d["K_s"] else 0.0)
    return dict(M=lam + 2 * mu, mu=mu, lam=lam, K=d["k"] / (d["rho_f"] * d["g_r"]), Q=1 / storage, alpha=d["alpha"],
                rho=n * d["rho_f"] + (1 - n) * d["rho_s"], rho_f=d["rho_f"])


def sub(S, *keys):
    return {k: S[k] for k in keys}


def derived(S):
    speeds = up_dispersion.limits(**sub(S, *UP))
    return ["derived: " + ", ".join("%s=%.8g" % kv for kv in S.items()),
            "derived: c_u=%(c_u).6g m/s, c_v=%(c_v).6g m2/s, w_c=%(w_c).6g rad/s, c_hf=%(c_hf).6g m/s" % speeds]


def write(name, parameters, columns, rows, notes=()):
    rows = np.atleast_2d(np.asarray(rows, float))
    with open(os.path.join(DATA, name + ".csv"), "w") as f:
        f.write("# %s\n" % name)
        for key, value in parameters.items():
            f.write("# %s = %s\n" % (key, value))
        for note in notes:
            f.write("# " + note + "\n")
        f.write(",".join(columns) + "\n")
        for row in rows:
            f.write(",".join("%.10g" % x for x in row) + "\n")
    print("%-32s %6d rows" % (name, len(rows)))


def s1(p):
    c = np.sqrt(p["E"] / p["rho"])
    T = 4 * p["L"] / c / (2 * p["n"] - 1) if p["ends"] == "fixed-free" else 2 * p["L"] / c / p["n"]
    t = np.linspace(0, 4 * T, 401)
    args = (p["E"], p["rho"], p["L"], p["v0"], p["n"], p["ends"])
    u, v, _ = bar_wave.mode(p["x_obs"], t, *args)
    sigma = bar_wave.mode(0.0, t, *args)[2]
    write("S1_bar_mode", p, ["t [s]", "u(x_obs) [m]", "v(x_obs) [m/s]", "sigma(0) [Pa]"], np.c_[t, u, v, sigma])


def s2(p):
    c, L = np.sqrt(p["E"] / p["rho"]), p["L"]
    t = np.linspace(0, 8 * L / c, 801) + 1e-9 * L / c
    uL, vL, _ = bar_wave.step_end(L, t, p["E"], p["rho"], L, p["s0"])
    um, vm, sm = bar_wave.step_end(L / 2, t, p["E"], p["rho"], L, p["s0"])
    sb = bar_wave.step_end(0., t, p["E"], p["rho"], L, p["s0"])[2]
    write("S2_bar_step", p, ["t [s]", "u(L) [m]", "v(L) [m/s]", "u(L/2) [m]", "v(L/2) [m/s]", "sigma(L/2) [Pa]",
                             "sigma(0) [Pa]"], np.c_[t, uL, vL, um, vm, sm, sb])


def s3(p):
    c, L = np.sqrt(p["M"] / p["rho"]), p["L"]
    x = np.array([L, 0., L / 2])
    rows = []
    for t in np.linspace(0, 8 * L / c, 401):
        u, v, s = bar_wave.gravity_step(x, t, p["M"], p["rho"], L, p["g"], 4000)
        rows.append([t, u[0], v[0], s[1], s[2]])
    write("S3_gravity_step", p, ["t [s]", "u(L) [m]", "v(L) [m/s]", "sigma(0) [Pa]", "sigma(L/2) [Pa]"], rows)


def s4(p):
    mu = p["E"] / (2 * (1 + p["nu"]))
    M = p["E"] * (1 - p["nu"]) / ((1 + p["nu"]) * (1 - 2 * p["nu"]))
    Y = np.linspace(0, p["l0"], 101)
    columns, data = ["Y [m]", "sigma_yy [Pa]"], [Y, -p["rho0"] * p["g"] * (p["l0"] - Y)]
    for law in ("hencky", "neohooke", "jaumann"):
        y, _, stretch = column_selfweight.solve(Y, law, M, p["rho0"], p["l0"], p["g"], mu)
        columns += ["y_%s [m]" % law, "u_%s [m]" % law, "stretch_%s [-]" % law]
        data += [y, y - Y, stretch]
    write("S4_column_selfweight", p, columns, np.array(data).T, ["M = %.8g Pa, mu = %.8g Pa" % (M, mu)])


def s5(p):
    g = np.linspace(0, p["gamma_max"], 201)
    jaumann, hencky = patch_rigid.shear_jaumann(g, p["G"]), patch_rigid.shear_hencky(g, p["G"])
    write("S5_simple_shear", p, ["gamma [-]", "s11_jaumann [Pa]", "s12_jaumann [Pa]", "s11_hencky [Pa]",
                                 "s12_hencky [Pa]"], np.c_[g, jaumann[0], jaumann[1], hencky[0], hencky[1]])


def p1(p):
    S, H, q = soil(p), p["H"], p["q"]
    args = (H, S["K"], S["M"], S["Q"], S["alpha"])
    cv, B1 = terzaghi.coeffs(S["K"], S["M"], S["Q"], S["alpha"])
    z, times = np.linspace(0, H, 81), [T * H**2 / cv for T in p["T_profiles"]]
    profiles = np.array([terzaghi.pressure(z, t, q, *args) for t in times]).T
    write("P1_terzaghi_p", p, ["z [m]"] + ["p(T=%g) [Pa]" % T for T in p["T_profiles"]], np.c_[z, profiles],
          derived(S) + ["t = T*%.10g s" % (H**2 / cv)])
    rows = []
    for T in np.r_[0, np.logspace(-5, 0.4, 160)]:
        t = max(T, 1e-14) * H**2 / cv
        base = float(terzaghi.pressure(np.array([0.]), t, q, *args)[0]) if T > 1e-4 else B1 * q
        rows.append([T, T * H**2 / cv, float(terzaghi.settlement(np.array([t]), q, *args)[0]), base])
    undrained = q * H / (S["M"] + S["alpha"]**2 * S["Q"])
    rows = [row + [undrained - row[2]] for row in rows]
    write("P1_terzaghi_s", p, ["T [-]", "t [s]", "settlement [m]", "p(z=0) [Pa]", "u(H) after the undrained state [m]"],
          rows, derived(S))


def p2(p):
    S, H = soil(p), p["H"]
    cv = terzaghi.coeffs(S["K"], S["M"], S["Q"], S["alpha"])[0]
    z = np.linspace(0, H, 81)
    r = [terzaghi.selfweight(z, T * H**2 / cv, H, S["K"], S["M"], S["rho"], S["rho_f"], p["g"], S["Q"], S["alpha"])
         for T in p["T_profiles"]]
    undrained = -S["rho"] * p["g"] * (H * z - z**2 / 2) / (S["M"] + S["alpha"]**2 * S["Q"])
    write("P2_selfweight_consolidation", p,
          ["z [m]"] + ["p(T=%g) [Pa]" % T for T in p["T_profiles"]] +
          ["u(T=%g) after the undrained state [m]" % T for T in p["T_profiles"]],
          np.c_[z, np.array([a[0] for a in r]).T, np.array([a[1] - undrained for a in r]).T],
          derived(S) + ["t = T*%.10g s" % (H**2 / cv)])


def p3(p):
    soils = [soil(p[layer]) for layer in ("bottom", "top")]
    layers = [dict(h=p[layer]["h"], **sub(S, "K", "M", "Q", "alpha")) for layer, S in zip(("bottom", "top"), soils)]
    roots = two_layer.eigen(*layers, 400)
    solve = lambda z, t: two_layer.solve(z, t, p["q"], *layers, roots=roots)
    z = np.linspace(0, layers[0]["h"] + layers[1]["h"], 201)
    write("P3_two_layer_p", p, ["z [m]"] + ["p(t=%g s) [Pa]" % t for t in p["t_profiles"]],
          np.c_[z, np.array([solve(z, t)[0] for t in p["t_profiles"]]).T], ["first decay rate %.10g 1/s" % roots[0]**2])
    undrained = sum(p["q"] * L["h"] / (L["M"] + L["alpha"]**2 * L["Q"]) for L in layers)
    rows = []
    for t in np.logspace(-2, 1.8, 200):
        pressure, s = solve(z[:1], t)
        rows.append([t, s, pressure[0], undrained - s])
    write("P3_two_layer_s", p, ["t [s]", "settlement [m]", "p(z=0) [Pa]", "u(H) after the undrained state [m]"], rows)


def p4(p):
    S, a = soil(p), p["a"]
    C = mandel.constants(S["mu"], p["nu"], S["alpha"], S["Q"], S["K"])
    start = p["F"] * C["B"] * (1 + C["nuu"]) / (3 * a)
    ux, uy = p["F"] * C["nuu"] / (2 * S["mu"]), -p["F"] * p["b"] * (1 - C["nuu"]) / (2 * S["mu"] * a)
    rows = []
    for T in np.logspace(-4, 0.5, 300):
        t = T * a * a / C["c"]
        r = mandel.solve(np.array([0., a]), t, p["F"], a, S["mu"], p["nu"], S["alpha"], S["Q"], S["K"], 600)
        rows.append([t, r[0][0], r[2][1] - ux, r[3] * p["b"] - uy, T, r[0][0] / start])
    write("P4_mandel_history", p, ["t [s]", "p(0) [Pa]", "ux(a) after the undrained state [m]",
                                   "uy(b) after the undrained state [m]", "T [-]", "p(0)/p0 [-]"], rows,
          derived(S) + ["p0 = %.10g Pa, nu_u = %.10g, c = %.10g m2/s; at t = 0: ux(a) = %.10g m, uy(b) = %.10g m"
                        % (start, C["nuu"], C["c"], ux, uy)])


def traces(points, values):
    """Columns of displacements and pressures at points; values: quantity, point, time."""
    columns, data = [], []
    for i, (x, z) in enumerate(points):
        for j, (quantity, unit) in enumerate((("ux", "m"), ("uz", "m"), ("p", "Pa"))):
            columns.append("%s(%g;%g) [%s]" % (quantity, x, z, unit))
            data.append(values[j, i])
    return columns, data


def p5(p):
    S, points = soil(p), np.array(p["points"])
    coefficients = sub(S, "M", "mu", *UP[1:])
    t = np.logspace(*np.log10(p["times"]), 150)
    y = np.array([strip_box.consolidation(points[:, 0], points[:, 1], s, p["q"], p["W"], p["H"], p["b"], coefficients,
                                          p["base"], N=p["N"], edge=p["edge"])[:3] for s in t])
    columns, data = traces(points, y.transpose(1, 2, 0))
    write("P5_strip_consolidation", p, ["t [s]"] + columns, np.c_[t, np.array(data).T],
          derived(S) + ["q from t = 0 on, falls linearly to 0 over |x-b| < edge/2"])


def d1(p):
    S, H = soil(p), p["H"]
    z, rows = np.linspace(0, H, 41), []
    for omega in p["omega"]:
        for k, form in enumerate(("up", "up0")):
            u, pressure, _ = up_column.harmonic(z, omega, p["q"], H, n=p["n"], form=form, **sub(S, *UP))
            rows += [[omega, k, a, abs(b), np.angle(b), abs(c), np.angle(c)] for a, b, c in zip(z, u, pressure)]
    write("D1_harmonic", p, ["omega [rad/s]", "form (0=up 1=up0)", "z [m]", "|u| [m]", "arg u [rad]", "|p| [Pa]",
                             "arg p [rad]"], rows, derived(S) + ["load q exp(i omega t)"])


def column(name, p):
    """Saturated columns under a load at the drained top."""
    S, H = soil(p), p["H"]
    load = dict(load="sin2", tr=p["t_ramp"]) if "t_ramp" in p else dict(load="step")
    t = np.linspace(0, p["t_end"], p["nt"])[1:]
    for form in ("up", "up0"):
        solve = lambda z, t: up_column.modal(z, t, p["q"], H, form=form, nmodes=p["nmodes"], **load, **sub(S, *UP))
        notes = derived(S) + ["form %s (%s the term rho_f u_tt in Darcy's law)" % (form, "with" if form == "up" else
                                                                                 "without"),
                              "excess over the static state; drained, p = 0, at z = H"]
        u, pressure, sigma, _ = solve(p["z_obs"], t)
        columns, data = ["t [s]"], [t]
        for i, z in enumerate(p["z_obs"]):
            columns += ["u(z=%g) [m]" % z, "p(z=%g) [Pa]" % z, "sigma_tot(z=%g) [Pa]" % z]
            data += [u[:, i], pressure[:, i], sigma[:, i]]
        write("%s_%s" % (name, form), p, columns, np.array(data).T, notes)
        if "t_profiles" in p:
            z = np.linspace(0, H, 161)
            _, pressure, _, _ = solve(z, p["t_profiles"])
            write("%s_profiles_%s" % (name, form), p, ["z [m]"] + ["p(t=%g s) [Pa]" % t for t in p["t_profiles"]],
                  np.c_[z, pressure.T], notes)


def d5(p):
    S, b = soil(p), p["m"] * np.pi / p["L"]
    t = np.linspace(0, p["t_end"], 601)
    columns, data = ["t [s]"], [t]
    notes = derived(S) + ["u = U(t) sin(b z), p = P(t) cos(b z), b = m pi/L = %.10g 1/m; rollers and impermeable at z = 0 "
                          "and z = L" % b]
    for form in ("up", "up0"):
        u, v, pressure, eigenvalues = up_dispersion.standing(t, b, p["v0"], form=form, **sub(S, *UP))
        columns += ["U_%s [m]" % form, "V_%s [m/s]" % form, "P_%s [Pa]" % form]
        data += [u, v, pressure]
        notes.append("eigenvalues (%s) = %s 1/s" % (form, ", ".join("%.10g%+.10gj" % (x.real, x.imag)
                                                                   for x in eigenvalues)))
    write("D5_standing", p, columns, np.array(data).T, notes)


def d6(p):
    S, points = soil(p), np.array(p["points"])
    coefficients = sub(S, "M", "mu", *UP[1:])
    pulse = strip_box.gauss_pulse(p["q"], p["t0"], p["sigma_t"])
    t, y = strip_box.dynamic(points[:, 0], points[:, 1], p["t_end"], p["nfft"], pulse, p["W"], p["H"], p["b"],
                             dict(coefficients, form="up"), p["base"], N=p["N"], edge=p["edge"])
    k = np.arange(0, len(t), max(1, len(t) // 500))
    columns, data = traces(points, y[:, :, k])
    write("D6_strip_dynamic_up", p, ["t [s]"] + columns, np.c_[t[k], np.array(data).T],
          derived(S) + ["load q(x) exp(-(t-t0)^2/(2 sigma_t^2)), q falls linearly to 0 over |x-b| < edge/2; from rest at "
                        "t = 0"])


def g1(p):
    S, H = soil(p), p["H"]
    z = np.linspace(0, H, 41)
    state = geostatic.state(z, H, S["rho"], S["rho_f"], p["g_r"], p["nu"], S["alpha"], p["hw"])
    u = geostatic.displacement(z, H, S["M"], S["rho"], S["rho_f"], p["g_r"], S["alpha"])
    write("G1_geostatic", p, ["z [m]", "p [Pa]", "szz_tot [Pa]", "szz_eff [Pa]", "sxx_tot [Pa]", "sxx_eff [Pa]",
                              "u_gravity [m]"], np.c_[z, np.array(state).T, u],
          derived(S) + ["szz_eff = szz_tot + alpha p; u_gravity for hw = 0"])


def n1(p):
    rows = []
    for k in p["k_list"]:
        U = sub(soil(dict(p, k=k)), *UP)
        rows.append([k] + [stability.dt_max(p["h"], dyn=dyn, **U) for dyn in (True, False)] +
                    [stability.dt_formula(p["h"], dyn=dyn, **U) for dyn in (True, False)])
    write("N1_timestep", p, ["k [m/s]", "up [s]", "up0 [s]", "formula up [s]", "formula up0 [s]"], rows,
          ["largest stable steps of the explicit scheme with pressures in the cells; formula: h^2/(D + sqrt(D^2 + c_u^2 "
           "h^2)), D = Q K (1-r) with, Q K without the term rho_f u_tt in Darcy's law"])


def bars(name, p):
    o = bar_impact.solve(p["L1"], p["E1"], p["rho1"], p["L2"], p["E2"], p["rho2"], p["V1"], p["V2"], p["t_end"],
                         nmin=p["ncell"])
    assert o["T1err"] < 1e-9
    stress, speed = bar_impact.contact(p["E1"], p["rho1"], p["E2"], p["rho2"], p["V1"], p["V2"])
    write(name, p, ["t [s]", "contact stress [Pa]", "mean v1 [m/s]", "mean v2 [m/s]", "energy1 [J/m2]", "energy2 [J/m2]"],
          np.c_[o["t"], o["F"], o["v1"], o["v2"], o["en1"], o["en2"]],
          ["first contact stress %.10g Pa, velocity of the interface %.10g m/s, separation at %s s" % (
              stress, speed, ", ".join("%.10g" % t for t in o["t_sep"])),
           "final mean velocities %.10g, %.10g m/s" % (o["v1"][-1], o["v2"][-1]),
           "t from the first contact on; values hold on [t, t + dt)"])


def c3(p):
    t, theta = np.linspace(0, p["t_end"], 101), np.radians(p["theta_deg"])
    columns, data = ["t [s]"], [t]
    for mu, v0 in p["mu_v0"]:
        x, v, _ = incline.block(t, theta, mu, p["g"], v0)
        columns += ["x_block(mu=%g v0=%g) [m]" % (mu, v0), "v_block(mu=%g v0=%g) [m/s]" % (mu, v0)]
        data += [x, v]
    for mu in p["mu_roller"]:
        columns += ["x_cyl(mu=%g) [m]" % mu, "v_cyl(mu=%g) [m/s]" % mu, "omega_cyl(mu=%g) [rad/s]" % mu]
        data += incline.roller(t, theta, mu, p["g"], p["R"])
    write("C3_incline", p, columns, np.array(data).T)


def c4(p):
    t = np.linspace(0, p["t_end"], 51)
    columns, data, notes = ["t [s]"], [t], []
    for law in ("effective", "total"):
        x, v, a, base = incline.saturated_slab(t, np.radians(p["theta_deg"]), p["mu"], p["rho"], p["rho_f"], p["alpha"],
                                               p["g"], p["H"], law == "effective")
        columns += ["x_%s [m]" % law, "v_%s [m/s]" % law]
        data += [x, v]
        notes.append("friction on %s stress: a = %.10g m/s2" % (law, a))
    notes.append("base: p=%(p).8g Pa, sigma_n_eff=%(sn_eff).8g Pa, sigma_n_tot=%(sn_tot).8g Pa" % base)
    write("C4_saturated_slab", p, columns, np.array(data).T, notes)


def c5(p):
    modulus = hertz.estar(p["E1"], p["nu1"], p["E2"] or np.inf, p["nu2"])
    contacts = [hertz.line(P, p["R"], modulus) for P in p["P"]]
    write("C5_hertz_line", p, ["P [N/m]", "b [m]", "p0 [Pa]", "tau_max [Pa]", "depth_tau_max [m]"],
          [[P, c["b"], c["p0"], 0.30028 * c["p0"], 0.78615 * c["b"]] for P, c in zip(p["P"], contacts)],
          ["E* = %.10g Pa" % modulus])


def c6(p):
    impact = hertz.impact(p["m"], p["R"], hertz.estar(p["E1"], p["nu1"], p["E2"] or np.inf, p["nu2"]), p["V"])
    write("C6_hertz_sphere_impact", p, ["dmax [m]", "T [s]", "Fmax [N]"],
          [[impact["dmax"], impact["T"], impact["Fmax"]]])


def i1(p):
    t = np.unique(np.r_[np.logspace(-7, np.log10(p["t_end"]), 60), np.linspace(p["t_end"] / 200, p["t_end"], 200)])
    Z_b, c_b = np.sqrt(p["E_b"] * p["rho_b"]), np.sqrt(p["E_b"] / p["rho_b"])
    for k in p["k"]:
        S = soil(dict(p, k=k))
        Z_u = np.sqrt(S["rho"] * (S["M"] + S["alpha"]**2 * S["Q"]))
        plateau, back = p["v0"] * Z_b * Z_u / (Z_b + Z_u), min(2 * p["L_b"] / c_b, 2 * p["H"] / (Z_u / S["rho"]))
        assert p["t_end"] < back
        columns, data = ["t [s]", "F_undrained_K=0 [Pa]"], [t, np.full_like(t, plateau)]
        for top, form in (("impermeable", "up"), ("drained", "up"), ("impermeable", "up0")):
            columns.append("F_%s_%s [Pa]" % (form, top))
            data.append(porous_impact.bar(t, p["v0"], p["E_b"], p["rho_b"], top=top, form=form, **sub(S, *UP)))
        write("I1_bar_on_column_k=%g" % k, dict(p, k=k), columns, np.array(data).T,
              derived(S) + ["Z_b=%.10g Z_u=%.10g Pa s/m; plateau %.10g Pa; first reflection returns at %.6g s" % (
                  Z_b, Z_u, plateau, back)])


def i2(p):
    t = np.linspace(p["t_end"] / 300, p["t_end"], 300)
    S = soil(dict(p, k=0.0))
    Z_u = np.sqrt(S["rho"] * (S["M"] + S["alpha"]**2 * S["Q"]))
    cases = [("K=0", porous_impact.rigid_undrained_finite(t, p["v0"], p["m"], Z_u, p["H"], Z_u / S["rho"]))]
    for k in p["k"]:
        cases.append(("k=%g" % k, porous_impact.rigid(t, p["v0"], p["m"], 60, H=p["H"],
                                                      **sub(soil(dict(p, k=k)), *UP))))
    columns, data, notes = ["t [s]"], [t], ["impermeable contact; Z_u=%.10g Pa s/m" % Z_u]
    for name, (F, V) in cases:
        lost = np.argmax(F < 0) if np.any(F < 0) else len(t)
        columns += ["F(%s) [Pa]" % name, "V(%s) [m/s]" % name]
        data += [np.where(np.arange(len(t)) < lost, y, np.nan) for y in (F, V)]
        notes.append("%s: contact lost at about %.6g s (nan from then on)" % (name, t[min(lost, len(t) - 1)]))
    write("I2_rigid_on_column", p, columns, np.array(data).T, notes)


def l1(p):
    S, H, q = soil(p), p["H"], p["q"]
    t_1 = H**2 / (S["K"] * S["M"])
    T, profile_T = np.r_[np.logspace(-3, np.log10(4), 120)], p["T_profiles"]
    columns, data, notes = ["T = K M t/H^2 [-]", "t [s]"], [T, T * t_1], derived(S)
    profile_columns, profiles = [], []
    for law in ("hencky", "neohooke"):
        args = (q, H, S["K"], S["M"], law, S["mu"], S["Q"])
        Z, J, p_cells, s = large_consolidation.solve(T * t_1, *args, n=1200)
        columns += ["u_%s [m]" % law, "p_base_%s [Pa]" % law]
        data += [-s, p_cells[:, 0]]
        final = H * (1 - column_selfweight.stretch(np.array([-q]), law, S["M"], S["mu"])[0])
        notes.append("final settlement, %s: %.10g m" % (law, final))
        _, J, p_cells, s = large_consolidation.solve(np.array(profile_T) * t_1, *args, n=1200)
        every = np.unique(np.r_[np.arange(0, 1200, 8), np.arange(1000, 1200, 4), 1199])
        for T_i, J_i, p_i, s_i in zip(profile_T, J, p_cells, s):
            # Places of the cells' centres from their volumes, which the graded mesh gives by its faces.
            faces = H * np.tanh(4 * np.linspace(0, 1, 1201)) / np.tanh(4)
            grown = J_i * np.diff(faces)
            y = np.cumsum(grown) - 0.5 * grown
            profile_columns += ["y_%s(T=%g) [m]" % (law, T_i), "p_%s(T=%g) [Pa]" % (law, T_i)]
            profiles += [np.r_[0, y[every], H - s_i], np.r_[p_i[0], p_i[every], 0]]
    write("L1_finite_strain_s", p, columns, np.array(data).T, notes)
    write("L1_finite_strain_p", p, profile_columns, np.array(profiles).T, notes)


TABLES = {"S1_bar_mode": s1, "S2_bar_step": s2, "S3_gravity_step": s3, "S4_column_selfweight": s4,
          "S5_simple_shear": s5, "P1_terzaghi": p1, "P2_selfweight_consolidation": p2,
          "P3_two_layer": p3, "P4_mandel": p4, "P5_strip_consolidation": p5, "D1_harmonic": d1,
          "D2_step": lambda p: column("D2_step", p), "D3_ramp": lambda p: column("D3_ramp", p),
          "D3_ramp_permeable": lambda p: column("D3_ramp_permeable", p),
          "D3_ramp_tight": lambda p: column("D3_ramp_tight", p), "D5_standing": d5,
          "D6_strip_dynamic": d6, "G1_geostatic": g1, "N1_timestep": n1,
          "C1_bars_identical": lambda p: bars("C1_bars_identical", p),
          "C2_bars_unequal": lambda p: bars("C2_bars_unequal", p), "C3_incline": c3, "C4_saturated_slab": c4,
          "C5_hertz_line": c5, "C6_hertz_sphere_impact": c6, "I1_bar_on_column": i1, "I2_rigid_on_column": i2,
          "L1_finite_strain": l1}

if __name__ == "__main__":
    with open(os.path.join(DATA, "params.json")) as file:
        parameters = json.load(file)
    for name, make in TABLES.items():
        if not sys.argv[1:] or any(name.startswith(wanted) for wanted in sys.argv[1:]):
            make(parameters[name])
