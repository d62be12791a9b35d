"""1D impact of an elastic bar or a rigid block on a saturated u-p column (exact), unilateral until separation.

Column 0<=z<=H (base fixed, impermeable) or half-space (H=inf). Contact at the top is IMPERMEABLE to the solid (the
relative flux normal = 0, R=0) or 'drained' (p=0).  Compressive contact stress F, downward velocity V of the interface:
  F(s) = Zs(s) V(s),
  half-space: u = sum U_i exp(-g_i x):  Zs = rho s (U1/g1 + U2/g2)/(U1+U2)  with U1:U2 from the drainage condition
     impermeable: sum [ (rho - alpha rho_f) s^2 - M g_i^2 ] U_i = 0    ('up');  drained: sum (rho s^2 - M g_i^2)/g_i U_i = 0
  undrained limit K=0: Zs = rho c_u =: Z_u (x coth(sH/c_u) for the finite column)
Bar (length L, rho_b, E_b), velocity v0:  V = v0/s - F/(Z_b tanh(sL/c_b));  => F = (v0/s)/(1/(Z_b tanh) + 1/Zs)
  K=0: F = v0 Z_b Z_u/(Z_b+Z_u) until the first reflection returns (min(2L/c_b, 2H/c_u)).
Rigid block (mass per area m): m (sV - v0) = -F => F = m v0 Zs/(m s + Zs);  K=0, H=inf: V = v0 exp(-Z_u t/m).
  K=0, finite H (until 4H/c_u ...): F(t) = Z_u [ V(t) + 2 sum_k V(t-2kH/c_u) ].
NOTE (model property): for K>0 the u-p model has Zs -> rho sqrt(M/(rho-alpha rho_f)) as s->inf (not Z_u!): the contact
stress starts at this much lower value and reaches the undrained plateau only after a few 1/w_c,
w_c = (M/Q+alpha^2)/((rho-alpha rho_f)K).  Compare with Z_u only if 1/w_c << the time scale resolved.
"""
import numpy as np
from up_column import gammas, laplace_profile
from laplace import dehoog


def impedance(s, M, K, Q, alpha, rho, rho_f, H=np.inf, top="impermeable", form="up"):
    s = np.asarray(s, complex)
    if K == 0:
        Zu = np.sqrt(rho * (M + alpha**2 * Q)); cu = Zu / rho
        return Zu * np.ones_like(s) if np.isinf(H) else Zu / np.tanh(s * H / cu)
    if not np.isinf(H):
        u, p, sg = laplace_profile(H, s, H, M, K, Q, alpha, rho, rho_f, form=form, top="drained" if top == "drained" else "imp")
        return -1.0 * 1.0 / (s * u)                      # unit compressive stress over downward velocity -s u
    ga, gb, a1, r1 = gammas(s, M, K, Q, alpha, rho, rho_f, form=form)
    ga_, gb_ = np.sqrt(ga), np.sqrt(gb)
    if top == "drained":
        ea, eb = (rho * s**2 - M * ga) / ga_, (rho * s**2 - M * gb) / gb_
    else:
        rr = rho - (alpha * rho_f if form == "up" else 0.0)
        ea, eb = rr * s**2 - M * ga, rr * s**2 - M * gb
    Ua, Ub = -eb, ea
    return rho * s * (Ua / ga_ + Ub / gb_) / (Ua + Ub)


def bar(t, v0, Eb, rhob, L=np.inf, N=50, **kw):
    Zb, cb = np.sqrt(Eb * rhob), np.sqrt(Eb / rhob)
    F = lambda s: v0 / s / ((1 / Zb if np.isinf(L) else 1 / (Zb * np.tanh(s * L / cb))) + 1 / impedance(s, **kw))
    return dehoog(F, t, N)      # (Talbot is not applicable: the principal square roots are only right for Re s > 0)


def rigid(t, v0, m, N=50, **kw):
    F = lambda s: m * v0 * impedance(s, **kw) / (m * s + impedance(s, **kw))
    V = lambda s: m * v0 / (m * s + impedance(s, **kw))
    return dehoog(F, t, N), dehoog(V, t, N)


def rigid_undrained_finite(t, v0, m, Zu, H, cu, n=20000):
    """K=0, exact by characteristics (method of steps): m V' = -Zu [V + 2 sum_k V(t-2kT)], T = H/cu, uniform fine grid,
    trapezoidal in the instantaneous term (O(dt^2)); use for independent checks and for late time."""
    t = np.asarray(t, float); tend = t.max() * 1.0001; T2 = 2 * H / cu
    nper = int(np.ceil(n * T2 / tend)); dt = T2 / nper; N = int(np.ceil(tend / dt)) + 1
    V = np.zeros(N + 1); V[0] = v0; S = np.zeros(N + 1)
    for i in range(N):
        S1 = (V[i + 1 - nper] + S[i + 1 - nper]) if i + 1 >= nper else 0.0     # sum_k V(t-2kT)
        V[i + 1] = (V[i] * (m / dt - Zu / 2) - Zu * (S[i] + S1)) / (m / dt + Zu / 2)
        S[i + 1] = S1
    tt = dt * np.arange(N + 1)
    return np.interp(t, tt, Zu * (V + 2 * S)), np.interp(t, tt, V)


if __name__ == "__main__":
    P = dict(M=2.2333e7, Q=5e9, alpha=1.0, rho=1670.0, rho_f=1000.0)
    Zu = np.sqrt(P["rho"] * (P["M"] + P["Q"]))
    Eb, rb, v0 = 2.1e9, 2400., 1.0; Zb = np.sqrt(Eb * rb)
    print("undrained plateau v0 Zb Zu/(Zb+Zu) = %.6e ; initial (K>0) plateau %.6e" % (v0 * Zb * Zu / (Zb + Zu), v0 * Zb * 1670 * np.sqrt(P["M"] / 670) / (Zb + 1670 * np.sqrt(P["M"] / 670))))
    t = np.logspace(-8, -2, 7)
    for k in (1e-3, 1e-5, 1e-7):
        a = bar(t, v0, Eb, rb, K=k / 9810, **P); b = bar(t, v0, Eb, rb, N=25, K=k / 9810, **P)
        print("k=%g F/plateau at t=1e-8..1e-2: %s  |deHoog(50)-deHoog(25)| %.1e" % (k, (a / (v0 * Zb * Zu / (Zb + Zu))).round(5), np.abs(a - b).max() / a.max()))
        assert np.abs(a - b).max() / a.max() < 1e-6
    # independent check of impedance: brute-force implicit FE in space/time for a rigid block on a finite column, K>0
    from scipy.sparse import bmat, csc_matrix, diags
    from scipy.sparse.linalg import splu
    H, m, K = 10., 5000., 1e-3 / 9810
    def fe(n):
        h = H / n
        Kmat = np.zeros((n + 1, n + 1)); Mm = Kmat.copy(); G = Kmat.copy()
        for e in range(n):
            ix = np.ix_([e, e + 1], [e, e + 1]); Kmat[ix] += np.array([[1, -1], [-1, 1]]) / h; Mm[ix] += h / 6 * np.array([[2, 1], [1, 2]]); G[ix] += 0.5 * np.array([[-1, -1], [1, 1]])   # int N_i' N_j
        Mu = P["rho"] * Mm.copy(); Mu[n, n] += m
        # unknowns v (nodes 1..n), p (0..n); natural BC K p' + K rho_f a = 0 at top (impermeable R=0), base
        Sp = Mm / P["Q"]; Hp = K * Kmat; C = P["alpha"] * G; Dy = K * P["rho_f"] * G.copy()
        # weak: int q (p_t/Q) + int q' K (p' + rho_f a) + int q alpha v' = 0 ;  mom: rho a N + N'(M u' - alpha p)=0
        Gq = G   # int q' a = G[q,a]
        i = slice(1, n + 1)
        dt = 5e-6; th = 0.5
        A = bmat([[csc_matrix(Mu[i, i] / dt + th * th * dt * P["M"] * Kmat[i, i]), csc_matrix(-th * C[i, :])],
                  [csc_matrix(Dy[:, i] / dt + th * P["alpha"] * G.T[:, i]), csc_matrix(Sp / dt + th * Hp)]]).tocsc()
        lu = splu(A); v = np.zeros(n + 1); u = np.zeros(n + 1); p = np.zeros(n + 1); v[n] = -v0
        V = [v0]; nt = 800
        for _ in range(nt):
            rhs = np.concatenate([(Mu @ v)[i] / dt - P["M"] * (Kmat @ (u + th * (1 - th) * dt * v))[i] + (1 - th) * (C @ p)[i],
                                  Dy[:, i] @ v[i] / dt - (1 - th) * P["alpha"] * (G.T[:, i] @ v[i]) + Sp @ p / dt - (1 - th) * Hp @ p])
            x = lu.solve(rhs); vn = np.zeros(n + 1); vn[i] = x[:n]; p = x[n:]
            u = u + dt * (th * vn + (1 - th) * v); v = vn; V.append(-v[n])
        return np.array(V), dt, nt
    VA, dt, nt = fe(150); VB, dt, nt = fe(300); V = 2 * VB - VA          # Richardson (start-up error is O(h))
    tt = dt * np.arange(nt + 1); idx = [100, 200, 400, 800]
    F, Vx = rigid(tt[idx], v0, m, 60, K=K, H=H, **P)
    F0, V0 = rigid_undrained_finite(tt[idx], v0, m, Zu, H, Zu / P["rho"])
    print("rigid block on finite column: V exact", Vx.round(6), "FE(h->0)", V[idx].round(6), "| K=0", V0.round(6))
    assert np.abs(Vx - V[idx]).max() < 5e-4
    F1, V1 = rigid(tt[idx], v0, m, 60, K=0, H=H, **P); print("K=0 finite: dehoog vs method of steps %.1e ; infinite vs exp %.1e" % (np.abs(V1 - V0).max(), abs(rigid(np.array([1e-3]), v0, m, K=0, **P)[1][0] - v0 * np.exp(-Zu * 1e-3 / m))))
