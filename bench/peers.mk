# The libraries that KSL is measured beside, each as a shared object with the C ABI of peer.h: make -f bench/peers.mk
# Everything is built in one fixed folder.  A failed compilation fails the whole.

OUT := build/bench
VENV := $(OUT)/venv
SITE := $(VENV)/site
PREFIX := $(SITE)/cmeel.prefix
PEERS := $(OUT)/peers

# Peers share no symbols with each other.
FLAGS := -std=c++20 -O3 -DNDEBUG -fPIC -shared -fvisibility=hidden -fvisibility-inlines-hidden -MMD -MP
LINK := -Wl,-Bsymbolic -Wl,--exclude-libs,ALL -Wl,--no-undefined
PINOCCHIO := -w -isystem $(PREFIX)/include -isystem $(PREFIX)/include/pinocchio/deprecated -isystem /usr/include/eigen3 \
  -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
  -DBOOST_FUSION_INVOKE_MAX_ARITY=12
NICE := nice -n 5

NAMES := pinocchio_gcc pinocchio_gcc_scalar pinocchio_clang pinocchio_clang_scalar pinocchio_wheel mujoco kdl
all: $(NAMES:%=$(PEERS)/%.so) $(OUT)/robots.txt
.PHONY: all
.DELETE_ON_ERROR:

$(VENV)/.installed: bench/requirements.txt
	test -x $(VENV)/bin/python || $${PYTHON:-python3} -m venv $(VENV)
	$(VENV)/bin/python -m pip install -q -r bench/requirements.txt
	ln -sfn "$$($(VENV)/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" $(SITE)
	mkdir -p $(PEERS)
	touch $@

$(OUT)/robots.txt: bench/robots.py $(VENV)/.installed
	$(VENV)/bin/python bench/robots.py $(OUT)

define PINOCCHIO_PEER
$(PEERS)/$(1).so: bench/peers/pinocchio.cpp $(VENV)/.installed
	$(NICE) $(2) $(FLAGS) -march=native $(3) $(PINOCCHIO) '-DBENCH_NAME="Pinocchio, $(4)"' '-DBENCH_LIBRARY="Pinocchio"' \
	  $$< -o $$@ $(LINK)
endef
$(eval $(call PINOCCHIO_PEER,pinocchio_gcc,g++,-fno-gnu-unique,gcc))
$(eval $(call PINOCCHIO_PEER,pinocchio_gcc_scalar,g++,-fno-gnu-unique -DEIGEN_DONT_VECTORIZE,gcc without Eigen vectors))
$(eval $(call PINOCCHIO_PEER,pinocchio_clang,clang++,,clang))
$(eval $(call PINOCCHIO_PEER,pinocchio_clang_scalar,clang++,-DEIGEN_DONT_VECTORIZE,clang without Eigen vectors))

# What the wheel has compiled.  The rest of Pinocchio (computeMinverse, regressors, frames) its users compile themselves.
WHEEL := aba crba $(addprefix impl::,rnea forwardKinematics computeRNEADerivatives computeABADerivatives computeCoriolisMatrix \
  ccrba computeCentroidalMap jacobianCenterOfMass computeJointJacobian)

# No -march here: alignment of Eigen's types must be that of the compiled library.
$(PEERS)/pinocchio_wheel.so: bench/peers/pinocchio.cpp $(VENV)/.installed
	$(NICE) g++ $(FLAGS) -fno-gnu-unique -DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION $(PINOCCHIO) \
	  '-DBENCH_NAME="Pinocchio, wheel"' '-DBENCH_LIBRARY="Pinocchio wheel"' $< -o $@ $(LINK) -Wl,--allow-shlib-undefined \
	  -L$(PREFIX)/lib -lpinocchio_default -Wl,-rpath,$(abspath $(PREFIX))/lib
	for f in $(WHEEL); do nm -DC $@ | grep -q " U .*pinocchio::$$f<" || \
	  { echo "$@ has its own $$f instead of the library's" >&2; exit 1; }; done

$(PEERS)/mujoco.so: bench/peers/mujoco.cpp $(VENV)/.installed
	$(NICE) g++ $(FLAGS) -march=native -isystem $(SITE)/mujoco/include $< -o $@ $(LINK) \
	  $(SITE)/mujoco/libmujoco.so.* -Wl,-rpath,$(abspath $(SITE))/mujoco

# The same: arrays made here are freed there.
$(PEERS)/kdl.so: bench/peers/kdl.cpp $(VENV)/.installed
	$(NICE) g++ $(FLAGS) -isystem /usr/include/eigen3 $< -o $@ $(LINK) -lorocos-kdl

-include $(wildcard $(PEERS)/*.d)
