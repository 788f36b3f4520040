// pow returns x^p for 0 < p < 1, within 2 ulp.
func pow(x, p float64) float64 {
    if x == 0 || math.IsInf(x, 1) {
        return x
    }
    m, e := math.Frexp(x)
    whole := float64(e) * p
    k := math.Floor(whole)
    rest := whole - k + math.FMA(float64(e), p, -whole)
    return math.Ldexp(math.Exp(p*math.Log(m))*math.Exp2(rest), int(k))
}
