# What people type. Programs are built by cargo; Python serves COLMAP's bindings only.

CARGO  ?= cargo
PYTHON ?= python3
PREFIX ?= /usr/local
PRESET ?= balanced
PHOTOS ?=
INPUT  ?=
SCENE  ?=

STAGES := import-colmap train-splat render evaluate decompose relight estimate-environment segment-select edit instruct export view report info provider
# Programs that run learned models for stages, called motes-NAME.
PROVIDERS := provider-sam
# One that compiles candle: outside of every other target. FEATURES=cuda or FEATURES=metal builds it for a GPU.
DIFFUSION := provider-diffusion
FEATURES ?=
BIN  := $(CURDIR)/target/release
VENV := $(CURDIR)/.venv
MDBOOK := $(CURDIR)/.mdbook
CONSUMERS := $(CURDIR)/.consumers

# In CI the lock file is the law; while developing, cargo may extend it.
LOCKED := $(if $(CI),--locked)

# The commit stands beside the programs, not in them: a commit then rebuilds nothing.
revision = revision=$$(git describe --always --dirty --abbrev=10 --exclude '*' 2>/dev/null) && \
    echo "$$revision" >'$(BIN)/motes-revision.txt' || rm -f '$(BIN)/motes-revision.txt'

.DELETE_ON_ERROR:
.PHONY: build provider-diffusion provider-diffusion-ci setup setup-consumers docs test fmt tidy licenses clippy doc unit fuzz lab lab-relit poses-ci lab-ci relight relight-ci edit edit-ci kitchen kitchen-ci truth schemas install dist uninstall clean help

build: ## build the stages and the dispatcher into target/release (the default)
	$(CARGO) build --release $(LOCKED) -p motes $(addprefix -p ,$(STAGES) $(PROVIDERS))
	@$(revision)

provider-diffusion: build ## build the provider of IC-Light and InstructPix2Pix, too; FEATURES=cuda or metal for a GPU
	$(CARGO) build --release $(LOCKED) -p $(DIFFUSION) $(if $(FEATURES),--features '$(FEATURES)')

provider-diffusion-ci:
	$(CARGO) clippy -p $(DIFFUSION) --all-targets --release $(LOCKED) -- -D warnings
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc -p $(DIFFUSION) --no-deps --release $(LOCKED)
	$(CARGO) test -p $(DIFFUSION) --release $(LOCKED)

setup: $(VENV)/.ready ## make the private Python environment .venv for COLMAP (pycolmap)

$(VENV)/.ready: requirements.txt scripts/setup-venv
	PYTHON='$(PYTHON)' scripts/setup-venv '$(VENV)' requirements.txt
	@touch '$@'

setup-consumers: ## install the programs that tests let open our exports (needs npm)
	scripts/setup-consumers '$(CONSUMERS)'

test: fmt tidy licenses clippy doc unit ## run every check, the cheap ones first

fmt:
	$(CARGO) fmt --all --check

tidy:
	$(CARGO) run --quiet --release $(LOCKED) -p xtask -- tidy

licenses:
	$(CARGO) run --quiet --release $(LOCKED) -p xtask -- licenses features

clippy:
	$(CARGO) clippy --workspace --exclude $(DIFFUSION) --all-targets --release $(LOCKED) -- -D warnings

doc:
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --workspace --exclude $(DIFFUSION) --no-deps --release $(LOCKED)

unit: setup-consumers
	$(CARGO) test --workspace --exclude $(DIFFUSION) --release $(LOCKED)
	$(CARGO) run --quiet --release $(LOCKED) -p xtask -- manuals help-words

fuzz: build ## hostile files, kills and rivals for the stages, two minutes long
	$(CARGO) run --quiet --release $(LOCKED) -p motes-fuzz -- --minutes 2

# The folder is made absolute here, because the recipe below changes folders.
define run-lab
	@photos='$(PHOTOS)'; \
	if [ -n "$$photos" ]; then \
	    photos=$$(cd "$$photos" 2>/dev/null && pwd) || \
	        { echo "make: no such folder of photos: $(PHOTOS)" >&2; exit 3; }; \
	fi; \
	$(MAKE) -C pipelines/lab BIN='$(BIN)' PYTHON='$(VENV)/bin/python' PHOTOS="$$photos" PRESET='$(1)' $(2)
endef

lab: setup build ## photos to a report page; PHOTOS=dir takes yours, PRESET=draft is quicker
	$(call run-lab,$(PRESET))

lab-relit: setup build ## the lab's next step: a 2D tool relights the pictures, the model takes their light; TOOL=program takes yours
	$(call run-lab,$(PRESET),$(if $(TOOL),TOOL='$(TOOL)') relit)

poses-ci: setup
	'$(VENV)/bin/python' -m unittest discover -s crates/import-colmap/tests/pycolmap

lab-ci: poses-ci build
	$(call run-lab,draft,all relit)

# A made scene brings its cameras; photos need COLMAP.
relight: $(if $(SCENE)$(INPUT),,setup) build $(if $(SCENE),truth) ## photos to the same scene at sunrise, midday and evening; PHOTOS=, INPUT= or SCENE=
	@photos='$(PHOTOS)'; input='$(INPUT)'; \
	for folder in "$$photos" "$$input"; do \
	    [ -z "$$folder" ] || [ -d "$$folder" ] || \
	        { echo "make: no such folder: $$folder" >&2; exit 3; }; \
	done; \
	[ -z "$$photos" ] || photos=$$(cd "$$photos" && pwd); \
	[ -z "$$input" ] || input=$$(cd "$$input" && pwd); \
	$(MAKE) -C pipelines/relight BIN='$(BIN)' PHOTOS="$$photos" \
	    INPUT="$$input" SCENE='$(SCENE)' PRESET='$(PRESET)'

relight-ci: build truth
	$(MAKE) -C pipelines/relight BIN='$(BIN)' OUT='$(or $(OUT),$(CURDIR)/out/relight-ci)' SCENE=studio WIDTH=160 VIEWS=12 \
	    PRESET=draft QUALITY=preview DECOMPOSE='--samples 2000'

edit: build truth ## a made scene: one object clicked and made matte black, another swapped, three lights, one page
	$(MAKE) -C pipelines/edit BIN='$(BIN)' PRESET='$(PRESET)'

edit-ci: build truth
	$(MAKE) -C pipelines/edit BIN='$(BIN)' OUT='$(or $(OUT),$(CURDIR)/out/edit-ci)' WIDTH=160 VIEWS=12 PRESET=draft \
	    QUALITY=preview DECOMPOSE='--samples 2000'

kitchen: build truth ## a made kitchen by one sentence: matte black cabinets with brass handles under three lights, beside the truth
	$(MAKE) -C pipelines/kitchen BIN='$(BIN)' PRESET='$(PRESET)'

kitchen-ci: build truth
	$(MAKE) -C pipelines/kitchen BIN='$(BIN)' OUT='$(or $(OUT),$(CURDIR)/out/kitchen-ci)' WIDTH=240 VIEWS=12 PRESET=draft \
	    QUALITY=preview DECOMPOSE='--samples 2000'

truth: ## build the maker and the judge of ground-truth scenes
	$(CARGO) build --release $(LOCKED) -p motes-truth

docs: ## render docs/ as a site in target/site (mdBook, installed privately on the first call)
	scripts/setup-docs '$(MDBOOK)'
	'$(MDBOOK)/bin/mdbook' build
	$(CARGO) run --quiet --release $(LOCKED) -p xtask -- site

schemas: ## write docs/formats/schema and the versions in pages from the code
	$(CARGO) run --quiet --release -p xtask -- schemas

# Only `motes` goes on PATH: `export` and `edit` would collide with the shell and other programs.
install: ## install to PREFIX (default /usr/local); DESTDIR stages a package
	$(CARGO) build --release $(LOCKED) -p motes $(addprefix -p ,$(STAGES) $(PROVIDERS))
	@$(revision)
	$(CARGO) run --quiet --release -p xtask -- man
	install -d '$(DESTDIR)$(PREFIX)/bin' '$(DESTDIR)$(PREFIX)/libexec/motes' '$(DESTDIR)$(PREFIX)/share/man/man1'
	install -m 755 '$(BIN)/motes' '$(DESTDIR)$(PREFIX)/bin/'
	for stage in $$(MOTES_STAGE_PATH= PATH=/nowhere '$(BIN)/motes' list); do \
	    install -m 755 "$(BIN)/$$stage" '$(DESTDIR)$(PREFIX)/libexec/motes/' || exit 1; \
	done
	for provider in $(PROVIDERS); do \
	    install -m 755 "$(BIN)/motes-$$provider" '$(DESTDIR)$(PREFIX)/libexec/motes/' || exit 1; \
	done
	[ ! -x '$(BIN)/motes-$(DIFFUSION)' ] || install -m 755 '$(BIN)/motes-$(DIFFUSION)' '$(DESTDIR)$(PREFIX)/libexec/motes/'
	install -d '$(DESTDIR)$(PREFIX)/libexec/motes/providers/provider_kit'
	install -m 755 scripts/providers/bin/motes-provider-* '$(DESTDIR)$(PREFIX)/libexec/motes/'
	for program in scripts/providers/bin/motes-provider-*; do \
	    install -m 644 "scripts/providers/$${program#*/bin/motes-provider-}.py" '$(DESTDIR)$(PREFIX)/libexec/motes/providers/' || exit 1; \
	done
	install -m 644 scripts/providers/requirements-providers.txt '$(DESTDIR)$(PREFIX)/libexec/motes/providers/'
	install -m 644 scripts/providers/provider_kit/*.py '$(DESTDIR)$(PREFIX)/libexec/motes/providers/provider_kit/'
	[ ! -f '$(BIN)/motes-revision.txt' ] || install -m 644 '$(BIN)/motes-revision.txt' '$(DESTDIR)$(PREFIX)/libexec/motes/'
	install -m 644 target/man/*.1 '$(DESTDIR)$(PREFIX)/share/man/man1/'
	@for place in bash:bash-completion/completions/motes zsh:zsh/site-functions/_motes fish:fish/vendor_completions.d/motes.fish; do \
	    file='$(DESTDIR)$(PREFIX)/share/'"$${place#*:}"; \
	    mkdir -p "$${file%/*}" && MOTES_STAGE_PATH= PATH=/nowhere '$(BIN)/motes' completions "$${place%%:*}" >"$$file" || exit 1; \
	done

dist: ## archive, wheel and checksums of the programs in dist/
	rm -rf build/tree dist
	$(MAKE) install DESTDIR='$(CURDIR)/build/tree' PREFIX=
	scripts/package build/tree dist

uninstall: ## remove what install wrote
	rm -rf '$(DESTDIR)$(PREFIX)/libexec/motes'
	rm -f '$(DESTDIR)$(PREFIX)/bin/motes' '$(DESTDIR)$(PREFIX)/share/man/man1/'motes-*.1
	cd '$(DESTDIR)$(PREFIX)/share' && rm -f bash-completion/completions/motes zsh/site-functions/_motes fish/vendor_completions.d/motes.fish

clean: ## remove build products and the Python environment
	$(CARGO) clean
	$(MAKE) -C pipelines/lab clean
	$(MAKE) -C pipelines/relight clean
	$(MAKE) -C pipelines/edit clean
	$(MAKE) -C pipelines/kitchen clean
	rm -rf '$(VENV)' '$(CONSUMERS)' '$(MDBOOK)' build dist

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-16s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
