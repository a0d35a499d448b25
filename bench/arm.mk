# Instructions on Arm, counted under emulation, KSL beside Pinocchio: make bench-arm.  Peers are those of peers.mk, compiled for aarch64 with
# few operations; robots come as tables, since there is no reader of robot files for that processor here.
include bench/peers.mk
.DEFAULT_GOAL := arm

ARM := $(OUT)/arm
ARM_COMPILERS := clang gcc
ARM_ROBOTS := ur5 panda talos
clang_on_arm := clang++ --target=aarch64-linux-gnu
gcc_on_arm := aarch64-linux-gnu-g++ -fno-gnu-unique
clang_kernels := -fno-slp-vectorize
gcc_kernels := -fno-tree-slp-vectorize

# What the counted operations need of KSL.  Kernels of others are absent: their tables are at address 0, and nothing calls them.
KERNELS := $(wildcard src/engine/kernels/algorithms/*.cpp)
ARM_KERNELS := $(shell grep -lE '^KSL_KERNELS\((inverse_dynamics|forward_dynamics|mass_matrix|mass_matrix_upper|inverse_dynamics_derivatives)\)' $(KERNELS))
ABSENT := $(patsubst %,ksl_kernels_%_neon,$(shell sed -n 's/^KSL_KERNELS(\([a-z_]*\)).*/\1/p' $(filter-out $(ARM_KERNELS),$(KERNELS))) inverse_kinematics) \
  ksl_array_kernels_neon
ARM_SOURCES := $(ARM_KERNELS) src/engine/kernels/finite.cpp $(wildcard src/engine/kernels/compiled_once/*.cpp) $(addprefix src/,$(shell python3 scripts/engine_sources.py)) \
  bench/arm/load.cpp bench/peers/ksl.cpp
KSL_FLAGS := -std=c++20 -O3 -DNDEBUG -fPIC -fvisibility=hidden -fvisibility-inlines-hidden -ffp-contract=off -DKSL_HAS_neon -DBENCH_FEW_OPERATIONS \
  -MMD -MP -Iinclude -Isrc
is_kernel = $(or $(findstring src/engine/kernels/algorithms/,$(1)),$(findstring src/engine/kernels/compiled_once/,$(1)),$(findstring src/engine/kernels/finite.cpp,$(1)))

define ARM_COMPILER
$(ARM)/$(1)/%.o: %.cpp
	@mkdir -p $$(dir $$@)
	$(NICE) $($(1)_on_arm) $(KSL_FLAGS) $$(if $$(call is_kernel,$$<),$($(1)_kernels) -DKSL_ISA=neon -DKSL_TABLE=ksl_finite_neon -DKSL_COMPILED_ONCE) -c $$< -o $$@

$(ARM)/peers/ksl_$(1).so: $(ARM_SOURCES:%.cpp=$(ARM)/$(1)/%.o)
	@mkdir -p $$(dir $$@)
	$($(1)_on_arm) -shared $$^ -o $$@ -Wl,-Bsymbolic -Wl,--exclude-libs,ALL -pthread $(ABSENT:%=-Wl,--defsym=%=0)

$(ARM)/peers/pinocchio_$(1).so $(ARM)/peers/pinocchio_$(1)_scalar.so: bench/peers/pinocchio.cpp $(VENV)/.installed
	@mkdir -p $$(dir $$@)
	$(NICE) $($(1)_on_arm) $(FLAGS) $(PINOCCHIO) -DBENCH_FEW_OPERATIONS $$(if $$(findstring scalar,$$@),-DEIGEN_DONT_VECTORIZE) \
	  '-DBENCH_NAME="Pinocchio, $(1)$$(if $$(findstring scalar,$$@), without Eigen vectors)"' '-DBENCH_LIBRARY="Pinocchio"' $$< -o $$@ $(LINK)

-include $(ARM_SOURCES:%.cpp=$(ARM)/$(1)/%.d)
endef
$(foreach compiler,$(ARM_COMPILERS),$(eval $(call ARM_COMPILER,$(compiler))))

$(ARM)/count: bench/arm/count.cpp bench/measure.hpp
	@mkdir -p $(dir $@)
	aarch64-linux-gnu-g++ -std=c++20 -O2 $< -o $@

$(ARM)/count_instructions.so: bench/arm/count_instructions.c
	@mkdir -p $(dir $@)
	cc -O2 -shared -fPIC -fvisibility=hidden $< -o $@

$(ARM)/robots.txt: bench/arm/robot_tables.py $(OUT)/robots.txt
	$(VENV)/bin/python bench/arm/robot_tables.py $(OUT)/robots.txt $(ARM) $(ARM_ROBOTS)

.PHONY: arm
arm: $(foreach c,$(ARM_COMPILERS),$(ARM)/peers/ksl_$(c).so $(ARM)/peers/pinocchio_$(c).so $(ARM)/peers/pinocchio_$(c)_scalar.so) \
  $(ARM)/count $(ARM)/count_instructions.so $(ARM)/robots.txt
