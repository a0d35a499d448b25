/* Memory that is freed twice on one path. */
#include <stdlib.h>

void release(char *x, int both);
void release(char *x, int both) {
  free(x);
  if (both)
    free(x);
}
