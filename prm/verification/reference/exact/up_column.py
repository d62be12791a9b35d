"""Linear u-p dynamics of a 1D saturated column (momentum of the mixture, and mass of the fluid with the generalised
Darcy law: eqs. (2a), (2b), (3) of Zhang, Wang and Chen 2009, "Material point method for dynamic analysis of saturated
porous media under external contact/impact of solid bodies"), exact.

  M u_zz - alpha p_z - rho u_tt = 0                                     (total momentum, excess over statics)
  p_t/Q = K p_zz + K rho_f u_ttz - alpha u_tz,     K = k/gamma_f         (mass; the rho_f term is the dynamic seepage)
0<=z<=H: base u=0 & impermeable (R=0 <=> p_z=0 there), top total stress sigma=-q(t), p=0 (drained) or R=0 (impermeable).
form: 'up', 'up0' (without rho_f u_tt in Darcy's law), 'uwp' (Biot's full equations, (1a-c) there).

Drained top: u=sum U_n(t) sin(b_n z), p=sum P_n(t) cos(b_n z), b_n=(2n-1)pi/(2H) separates exactly:
  rho U'' = -M b^2 U + alpha b P - (2/H)(-1)^(n-1) q(t)
  P'/Q    = -K b^2 P + K rho_f b U'' - alpha b U'
=> a 3x3 ODE per mode, solved exactly (eigenvalues).  harmonic(): closed form for q exp(i w t).
laplace_profile(): closed form in s for both drainage conditions and all three formulations.
"""
import numpy as np


def gammas(s, M, K, Q, alpha, rho, rho_f, n=0.4, form="up"):
    """the two roots gamma^2 and the coefficients of the transformed system."""
    s = np.asarray(s, complex)
    if form == "uwp":
        Ks = 1 / (1 / K + rho_f * s / n); a1 = alpha - rho_f * s * Ks; r1 = rho - rho_f**2 * s * Ks; a2 = alpha * s - Ks * rho_f * s**2
    else:
        Ks = K + 0 * s; a1 = alpha + 0 * s; r1 = rho + 0 * s; a2 = alpha * s - (K * rho_f * s**2 if form == "up" else 0)
    A = M * Ks; B = M * s / Q + r1 * Ks * s**2 + a1 * a2; C = r1 * s**3 / Q
    D = np.sqrt(B * B - 4 * A * C)
    D = np.where(np.real(np.conj(B) * D) < 0, -D, D)
    big = (B + D) / 2
    return C / big, big / A, a1, r1          # gamma^2: small root (fast wave for w<<w_c), large root (slow/diffusive)


def laplace_profile(z, s, H, M, K, Q, alpha, rho, rho_f, n=0.4, form="up", top="drained"):
    """u, p, sigma_total for unit compressive top stress (q(s)=1). z scalar, s array."""
    g1, g2, a1, r1 = gammas(s, M, K, Q, alpha, rho, rho_f, n, form)   # order irrelevant
    out = []
    cs = []
    for g2_ in (g1, g2):
        g = np.sqrt(g2_)
        P = (M * g2_ - r1 * s**2) / (a1 * g)                 # p = P cosh(gz), u = sinh(gz), scaled by exp(-gH)
        e = np.exp(-g * (H - z)); em = np.exp(-g * (H + z)); E2 = np.exp(-2 * g * H)
        sh, ch = (e - em) / 2, (e + em) / 2
        shH, chH = (1 - E2) / 2, (1 + E2) / 2
        sg = M * g - alpha * P                                # total stress amplitude * cosh
        drain = P * chH if top == "drained" else (P * g + rho_f * (s**2 if form != "up0" else 0 * s)) * shH
        cs.append((g, P, sh, ch, sg, sg * chH, drain))
    (gA, PA, shA, chA, sA, SA, dA), (gB, PB, shB, chB, sB, SB, dB) = cs
    det = SA * dB - SB * dA
    cA, cB = -dB / det, dA / det
    return cA * shA + cB * shB, cA * PA * chA + cB * PB * chB, cA * sA * chA + cB * sB * chB


def harmonic(z, omega, q, H, **kw):
    """complex amplitudes u,p,sigma for sigma_top = -q exp(i omega t)."""
    r = [laplace_profile(zz, np.array([1j * omega]), H, **kw) for zz in np.atleast_1d(z)]
    return tuple(q * np.array([x[k][0] for x in r]) for k in range(3))


def modal(z, t, q, H, M, K, Q, alpha, rho, rho_f, form="up", load="step", tr=None, nmodes=4000, fields=False):
    """drained top. load: 'step' | 'sin2' (q sin^2(pi t/(2 tr)) up to tr, then q) ; returns u[t,z], p[t,z], sigma_tot, v."""
    z = np.atleast_1d(np.asarray(z, float)); t = np.atleast_1d(np.asarray(t, float))
    nn = np.arange(1, nmodes + 1); b = (2 * nn - 1) * np.pi / (2 * H); sg = (-1.0)**(nn - 1)
    rf = rho_f if form == "up" else 0.0
    A = np.zeros((nmodes, 3, 3)); A[:, 0, 1] = 1
    A[:, 1, 0] = -M * b**2 / rho; A[:, 1, 2] = alpha * b / rho
    A[:, 2] = Q * (K * rf * b)[:, None] * A[:, 1]; A[:, 2, 2] += -Q * K * b**2; A[:, 2, 1] += -Q * alpha * b
    fv = -(2 / H) * sg / rho
    f = np.stack([0 * b, fv, Q * K * rf * b * fv], 1) * q
    sc = np.stack([1 / b, np.sqrt(M / rho) * np.ones_like(b), np.sqrt(M * Q) * np.ones_like(b)], 1)   # scaling
    As = A * sc[:, None, :] / sc[:, :, None]; fs = f / sc
    lam, V = np.linalg.eig(As)
    cf = np.linalg.solve(V, fs[:, :, None].astype(complex))[:, :, 0]
    Us = np.zeros((len(t), nmodes, 3))
    def part_const(tt):              # int_0^t exp(lam (t-s)) ds
        return np.where(np.abs(lam) * tt < 1e-8, tt, np.expm1(lam * tt) / np.where(lam == 0, 1, lam))
    def part_cos(tt, w):             # int_0^t exp(lam(t-s)) cos(ws) ds
        return (lam * (np.exp(lam * tt) - np.cos(w * tt)) + w * np.sin(w * tt)) / (lam**2 + w**2)
    for i, ti in enumerate(t):
        if load == "step":
            y = part_const(ti)
        else:
            w = np.pi / tr
            if ti <= tr:
                y = 0.5 * part_const(ti) - 0.5 * part_cos(ti, w)
            else:
                y = (0.5 * part_const(tr) - 0.5 * part_cos(tr, w)) * np.exp(lam * (ti - tr)) + part_const(ti - tr)
        Us[i] = np.real(np.einsum("nij,nj->ni", V, y * cf)) * sc
    # static (drained) limit handled analytically: U_inf = -(2/H) sg q/(M b^2) <-> u=-qz/M
    amp = np.ones(len(t)) if load == "step" else np.where(t < tr, np.sin(np.pi * np.minimum(t, tr) / (2 * tr))**2, 1.0)
    Uinf = -(2 / H) * sg * q / (M * b**2)
    S, C = np.sin(np.outer(b, z)), np.cos(np.outer(b, z))
    dU = Us[:, :, 0] - amp[:, None] * Uinf
    u = dU @ S - np.outer(amp, z) * q / M
    p = Us[:, :, 2] @ C
    damp = np.zeros(len(t)) if load == "step" else np.where(t < tr, 0.5 * np.pi / tr * np.sin(np.pi * np.minimum(t, tr) / tr), 0.0)
    v = (Us[:, :, 1] - damp[:, None] * Uinf) @ S - np.outer(damp, z) * q / M      # same lifting for the velocity
    sig = M * (dU @ (b[:, None] * C)) - np.outer(amp, np.ones_like(z)) * q - alpha * p
    return u, p, sig, v


PAR = dict(M=2.2333e7, K=1e-2 / 9810.0, Q=5e9, alpha=1.0, rho=1670.0, rho_f=1000.0)

if __name__ == "__main__":
    from laplace import dehoog, talbot, bromwich_fft
    H = 10.0
    for nm, P in (("k=1e-2", PAR), ("k=1e-5", dict(PAR, K=1e-5 / 9810)), ("soft Q", dict(M=2e7, K=1e-3 / 9810, Q=5e7, alpha=.8, rho=1900., rho_f=1000.))):
        z = np.array([2., 5., 9.]); tr = 0.02; T = 0.6
        for form in ("up", "up0"):
            # independent route: Bromwich-FFT of closed-form Laplace solution with the sin^2 ramp load
            w = np.pi / tr
            # q(t)=0.5(1-cos wt) for t<tr then 1: since cos(w(t-tr)) = -cos(wt), q = h(t) + h(t-tr), h = 0.5(1-cos wt)
            qs = lambda s: 0.5 * (1 / s - s / (s**2 + w**2)) + np.exp(-s * tr) * 0.5 * (1 / s - s / (s**2 + w**2))
            n = 2**16
            us, ps = [], []
            for zz in z:
                tt, fu = bromwich_fft(lambda s: laplace_profile(zz, s, H, form=form, **P)[0] * qs(s), 2 * T, n, 1e-9)
                _, fp = bromwich_fft(lambda s: laplace_profile(zz, s, H, form=form, **P)[1] * qs(s), 2 * T, n, 1e-9)
                us.append(fu); ps.append(fp)
            idx = [n // 60, n // 12, n // 4, n // 2 - 1]
            u, p, sig, v = modal(z, tt[idx], 1.0, H, form=form, load="sin2", tr=tr, nmodes=600, **P)
            eu = max(np.abs(np.array(us)[:, idx].T - u).max() / np.abs(u).max(), 0); ep = np.abs(np.array(ps)[:, idx].T - p).max()
            # PDE residuals by finite differences on the modal solution
            z0 = 6.3; cu = np.sqrt((P["M"] + P["alpha"]**2 * P["Q"]) / P["rho"]); t0 = (H - z0) / cu + 0.3 * tr; hz, ht = 0.02, 2e-5
            uu, pp, ss, vv = modal([z0 - hz, z0, z0 + hz], [t0 - ht, t0, t0 + ht], 1.0, H, form=form, load="sin2", tr=tr, nmodes=4000, **P)
            a = (uu[2] - 2 * uu[1] + uu[0]) / ht**2
            r1 = P["M"] * (uu[1, 2] - 2 * uu[1, 1] + uu[1, 0]) / hz**2 - P["alpha"] * (pp[1, 2] - pp[1, 0]) / (2 * hz) - P["rho"] * a[1]
            r2 = (pp[2, 1] - pp[0, 1]) / (2 * ht) / P["Q"] - P["K"] * (pp[1, 2] - 2 * pp[1, 1] + pp[1, 0]) / hz**2 - (P["K"] * P["rho_f"] * (a[2] - a[0]) / (2 * hz) if form == "up" else 0) + P["alpha"] * (vv[1, 2] - vv[1, 0]) / (2 * hz)
            s1 = abs(P["rho"] * a[1]) + 1e-12; s2 = abs((vv[1, 2] - vv[1, 0]) / (2 * hz)) + 1e-15
            print("%-7s %-4s modal vs Laplace: u %.1e p %.1e | residual mom %.1e mass %.1e" % (nm, form, eu, ep, r1 / s1, r2 / s2))
            assert eu < 1e-5 and ep < 1e-4 and abs(r1 / s1) < 1e-3 and abs(r2 / s2) < 1e-3
    # step load: modal vs mpmath-free de Hoog
    t = np.array([0.03, 0.2, 1.0]); z = [7.0]
    u, p, s, v = modal(z, t, 1.0, H, nmodes=20000, **PAR)
    ul = dehoog(lambda S: laplace_profile(7.0, S, H, **PAR)[0] / S, t, 60); pl = dehoog(lambda S: laplace_profile(7.0, S, H, **PAR)[1] / S, t, 60)
    print("step: u modal/dehoog", (u[:, 0] / ul).round(7), "p", p[:, 0].round(6), pl.round(6))
    # limits: quasi-static -> terzaghi ; undrained K->0 -> elastic bar with M_u
    import terzaghi, bar_wave
    Pq = dict(PAR, rho=1e-6, rho_f=0.0); t = 0.5
    up = modal([0., 4., 8.], [t], 1e5, H, nmodes=600, **Pq)
    print("rho->0 vs Terzaghi: p %.1e u %.1e" % (np.abs(up[1][0] - terzaghi.pressure(np.array([0., 4., 8.]), t, 1e5, H, PAR["K"], PAR["M"], PAR["Q"])).max() / 1e5, np.abs(up[0][0] - terzaghi.displacement(np.array([0., 4., 8.]), t, 1e5, H, PAR["K"], PAR["M"], PAR["Q"])).max() / (1e5 * H / PAR["M"])))
    Pu = dict(PAR, K=1e-16); Mu = PAR["M"] + PAR["Q"]
    uu = modal([3., 6.], [0.004, 0.011], 1e5, H, nmodes=20000, **Pu)[0]
    ub = np.array([[bar_wave.step_end(zz, tt, Mu, PAR["rho"], H, -1e5)[0] for zz in (3., 6.)] for tt in (0.004, 0.011)])
    print("K->0 vs undrained bar: %.1e" % (np.abs(uu - ub).max() / np.abs(ub).max()))
    # harmonic: long-time forced response of modal ODE = closed form (check residual of ODE in frequency domain)
    for form in ("up", "up0", "uwp"):
        uh, ph, sh = harmonic([H], 50.0, 1e3, H, n=0.33, form=form, **PAR); print("harmonic w=50 %-4s |u(H)|=%.6e arg=%.4f  |p(0)|=%.3f" % (form, abs(uh[0]), np.angle(uh[0]), abs(harmonic([0.], 50., 1e3, H, n=.33, form=form, **PAR)[1][0])))
