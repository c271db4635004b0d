/* One step of the integrators of chainunit.core.integrators, in numbers or in vectors of numbers, with the constants
 * generated from there: for FMUs and for the lanes of batches. The file that includes this one defines
 *
 * Number, Truth           a number, and what a comparison gives; ALL_TRUE, finite_all(x, n), and
 *                         GOES_ON(truth): whether another stage is needed if the stages before it were `truth`
 * OF_DOUBLE(x)               a Number from a double
 * CHOOSE(truth, x, y)     x if the comparison holds, else y; SMALLER(x, y), LARGER(x, y), SIZE(x), POWER(x, exponent)
 * Course, slope_at(course, since, x, dx)
 *                         the derivatives of the states x at a time since the begin of the step; whether they are finite
 */

/* the rest of the interval takes one step or two equal ones, so that no tiny step remains */
static Number step_size(Number pace, Number left) {
    return CHOOSE(pace >= left, left, CHOOSE(pace > 0.5 * left, 0.5 * left, pace));
}

/* The pair of Dormand and Prince of orders 5 and 4: the states `at` after a step of the size h from x, and the derivatives
 * k at its stages, one stage after the other; whether they are finite. The first of the stages may be `known`. */
static Truth dormand_prince(Course *course, int n, int known, Number since, Number h, const Number *x, Number *k, Number *at) {
    Truth usable = known ? ALL_TRUE : slope_at(course, since, x, k);
    for (int s = 1; s < 7 && GOES_ON(usable); ++s) {
        for (int i = 0; i < n; ++i) {
            Number sum = STAGES[s][0] * k[i];
            for (int j = 1; j < s; ++j) sum += STAGES[s][j] * k[j * n + i];
            at[i] = x[i] + h * sum;
        }
        usable = usable & slope_at(course, since + h * NODES[s], at, k + s * n);
    }
    return GOES_ON(usable) ? usable & finite_all(at, n) & finite_all(k + 6 * n, n) : usable;
}

/* its error over the permitted one */
static Number error_of(int n, const Number *x, const Number *at, const Number *k, Number h, double tolerance,
                       const double *nominal) {
    Number error = OF_DOUBLE(0.0);
    for (int i = 0; i < n; ++i) {
        Number sum = ERRORS[0] * k[i];
        for (int s = 1; s < 7; ++s) sum += ERRORS[s] * k[s * n + i];
        const Number size = LARGER(LARGER(SIZE(x[i]), SIZE(at[i])), OF_DOUBLE(nominal[i]));
        error = LARGER(error, SIZE(h * sum) / (tolerance * size));
    }
    return error;
}

/* the next step */
static Number next_pace(Number pace, Number h, Number error, Truth usable, double longest) {
    const Number wanted = CHOOSE(error < NO_ERROR, OF_DOUBLE(MOST_GROWTH), SAFETY * POWER(error, ERROR_POWER));
    const Number growth = CHOOSE(usable, wanted, OF_DOUBLE(LEAST_GROWTH));
    Number next = h * SMALLER(LARGER(growth, OF_DOUBLE(LEAST_GROWTH)), OF_DOUBLE(MOST_GROWTH));
    /* a step that the end of the interval shortened does not shorten the next one */
    next = CHOOSE(usable & (error <= 1.0) & (h < pace), LARGER(next, pace), next);
    return SMALLER(LARGER(next, OF_DOUBLE(SHORTEST * longest)), OF_DOUBLE(longest));
}

/* The classical Runge-Kutta method: the states `later` after step number `taken` of the size h from x; whether the
 * derivatives at its stages, k, are finite. */
static Truth rk4(Course *course, int n, double taken, Number h, const Number *x, Number *k, Number *at, Number *later) {
    Truth usable = ALL_TRUE;
    for (int i = 0; i < n; ++i) later[i] = x[i];
    for (int s = 0; s < 4 && GOES_ON(usable); ++s) {
        for (int i = 0; i < n; ++i) at[i] = s ? x[i] + RK4_NODES[s] * h * k[i] : x[i];
        usable = usable & slope_at(course, (taken + RK4_NODES[s]) * h, at, k);
        for (int i = 0; i < n; ++i) later[i] += RK4_WEIGHTS[s] * h * k[i];
    }
    return usable;
}
