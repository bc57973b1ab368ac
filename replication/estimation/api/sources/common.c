/* out (rows, columns) += left (rows, inner) right (inner, columns). */
static void obs_add(double *out, const double *left, const double *right, int rows, int inner, int columns)
{
    int i, j, k;
    for (i = 0; i < rows; i++)
        for (k = 0; k < inner; k++)
            for (j = 0; j < columns; j++)
                out[i * columns + j] += left[i * inner + k] * right[k * columns + j];
}

/* Whether a number is infinite or, unless there may be gaps, missing. */
static int obs_bad(const double *x, int count, int gaps)
{
    int i;
    for (i = 0; i < count; i++)
        if (gaps ? isinf(x[i]) : !isfinite(x[i]))
            return 1;
    return 0;
}
