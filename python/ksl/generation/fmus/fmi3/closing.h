/* A closed mechanism after a step: the nearest position and velocity that keep its FMU_LOOPS equations, by Gauss-Newton steps, the shortest ones that
   close the linearised loops, as KSL's m.simulate moves them.  fmu_opening has errors, as lengths, and their rates, which are linear in v. */
#ifndef KSL_CLOSING_H
#define KSL_CLOSING_H

#define FMU_MOST_CLOSING 20

static double fmu_largest(const double *x, int n) {
  double most = 0;
  int i;
  for (i = 0; i < n; ++i)
    if (!(fabs(x[i]) <= most) && most == most) /* NaN stays */
      most = fabs(x[i]);
  return most;
}

/* May the state be taken as a closed one. */
static int fmu_is_closed(const double *q, const double *v) {
  double error[FMU_LOOPS], rate[FMU_LOOPS], moved = 0;
  int j;
  fmu_opening(q, v, error, rate);
  for (j = 0; j < FMU_NV; ++j)
    moved += fabs(v[j]) * (FMU_LENGTH > 1 ? FMU_LENGTH : 1);
  return fmu_largest(error, FMU_LOOPS) <= FMU_ACCEPTED * FMU_LENGTH &&
         fmu_largest(rate, FMU_LOOPS) <= FMU_ACCEPTED / 4 * moved + FMU_CLOSED * FMU_LENGTH;
}

/* Takes from row i what it has along the unit row u. */
static void fmu_reduce(double (*K)[FMU_NV], double *b, int i, int u) {
  double along = 0;
  int j;
  for (j = 0; j < FMU_NV; ++j)
    along += K[i][j] * K[u][j];
  for (j = 0; j < FMU_NV; ++j)
    K[i][j] -= along * K[u][j];
  b[i] -= along * b[u];
}

static double fmu_square(const double *row) {
  double sum = 0;
  int j;
  for (j = 0; j < FMU_NV; ++j)
    sum += row[j] * row[j];
  return sum;
}

/* The shortest x with K x = b, by Gram and Schmidt's method with pivots; rows that follow from others are left out.  Replaces K and b. */
static void fmu_shortest(double (*K)[FMU_NV], double *b, double *x) {
  int order[FMU_LOOPS], rank, i, j;
  double least = 0;
  for (i = 0; i < FMU_LOOPS; ++i)
    order[i] = i;
  for (j = 0; j < FMU_NV; ++j)
    x[j] = 0;
  for (rank = 0; rank < FMU_LOOPS; ++rank) {
    int p = rank, row;
    double most = 0, inverse;
    for (i = rank; i < FMU_LOOPS; ++i) {
      const double square = fmu_square(K[order[i]]);
      if (square > most)
        most = square, p = i;
    }
    if (rank == 0)
      least = most * FMU_RANK * FMU_RANK;
    if (!(most > least))
      break;
    row = order[p], order[p] = order[rank], order[rank] = row;
    for (i = 0; i < rank; ++i) /* again: what rounding left of the earlier ones */
      fmu_reduce(K, b, row, order[i]);
    inverse = 1 / sqrt(fmu_square(K[row]));
    for (j = 0; j < FMU_NV; ++j)
      K[row][j] *= inverse;
    b[row] *= inverse;
    for (i = rank + 1; i < FMU_LOOPS; ++i)
      fmu_reduce(K, b, order[i], row);
    for (j = 0; j < FMU_NV; ++j)
      x[j] += b[row] * K[row][j];
  }
}

/* x: the shortest change of a motion at q whose equations have the rates b, which are replaced. */
static void fmu_change(const double *q, double *b, double *x) {
  double K[FMU_LOOPS][FMU_NV], error[FMU_LOOPS], column[FMU_LOOPS], unit[FMU_NV] = {0};
  int i, j;
  for (j = 0; j < FMU_NV; ++j) {
    unit[j] = 1;
    fmu_opening(q, unit, error, column);
    unit[j] = 0;
    for (i = 0; i < FMU_LOOPS; ++i)
      K[i][j] = column[i];
  }
  fmu_shortest(K, b, x);
}

/* False where no closed position is nearby. */
static int fmu_close(double *q, double *v) {
  double error[FMU_LOOPS], rate[FMU_LOOPS], x[FMU_NV], opened = 0, before = HUGE_VAL;
  int k, j;
  for (k = 0; k < FMU_MOST_CLOSING; ++k, before = opened) {
    fmu_opening(q, v, error, rate);
    opened = fmu_largest(error, FMU_LOOPS);
    if (opened <= (FMU_CLOSED + 4 * DBL_EPSILON * fmu_largest(q, FMU_NQ)) * FMU_LENGTH)
      break;
    if (!(opened < before))
      return 0;
    fmu_change(q, error, x);
    for (j = 0; j < FMU_NV; ++j)
      x[j] = -x[j];
    fmu_move(q, x, q);
  }
  fmu_change(q, rate, x);
  for (j = 0; j < FMU_NV; ++j)
    v[j] -= x[j];
  return k < FMU_MOST_CLOSING;
}

#endif
