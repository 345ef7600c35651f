# What the makefiles of the components share. SPDX-License-Identifier: MIT
#
# Before it is included: COMPONENT, the name of the .comp, in the folder SOURCES with what else it is made of.
# It needs linuxcnc-uspace-dev: `halcompile`, and the Makefile.modinc that it names.

LINUXCNC := $(dir $(abspath $(lastword $(MAKEFILE_LIST))))
TRUEAXIS ?= /usr/local
LIBRARY := $(TRUEAXIS)/lib/libtrueaxis.a
HALCOMPILE ?= halcompile
MANDIR ?= /usr/share/man

obj-m := $(COMPONENT).o
$(COMPONENT)-objs := $(COMPONENT)-linked.o

include $(shell $(HALCOMPILE) --print-modinc)

# `halcompile` writes functions that nobody calls, and so do the headers for a component that needs half of them.
EXTRA_CFLAGS += -O2 -std=gnu11 -Wall -Wextra -Wno-unused-function -I$(SOURCES) -I$(LINUXCNC) -I$(TRUEAXIS)/include
# What nobody calls stays out. (Makefile.modinc puts LDFLAGS before the objects, so no library can be named there.)
LDFLAGS += -Wl,--gc-sections -Wl,--strip-debug

modules: $(COMPONENT).9

$(COMPONENT).c: $(SOURCES)$(COMPONENT).comp
	$(HALCOMPILE) --preprocess -o $@ $<
$(COMPONENT).o: $(COMPONENT).c $(wildcard $(SOURCES)*.h $(LINUXCNC)*.h) $(TRUEAXIS)/include/trueaxis.h
# The library is linked into an object: from there on no order of arguments can lose it.
$(COMPONENT)-linked.o: $(COMPONENT).o $(LIBRARY)
	ld -r -o $@ $^

# How many pins there are is a number for us, and a sentence for readers; parameters are no numbers.
# Descriptions are troff; halcompile of LinuxCNC 2.10 takes them for AsciiDoc, and needs asciidoctor for the page.
ifneq ($(shell $(HALCOMPILE) --help 2>&1 | grep -e --adoc),)
DESCRIBED := page/$(COMPONENT).comp
$(DESCRIBED): $(SOURCES)$(COMPONENT).comp
	mkdir -p page
	sed -e 's/\\\\f[BI]\([^\]*\(\\\\-[^\]*\)*\)\\\\fR/*\1*/g' -e 's/\\\\-/-/g' -e 's/^\.B \(.*\)/*\1*/' \
	    -e 's/^\.SS \(.*\)/\n=== \1\n/' -e 's/^\.nf$$/[subs=quotes]\n----/' -e 's/^\.fi$$/----/' -e '/^\.R[SE]$$/d' $< > $@
else
DESCRIBED := $(SOURCES)$(COMPONENT).comp
endif
$(COMPONENT).9: $(DESCRIBED)
	$(HALCOMPILE) --document -o $@ $<
	sed -i -e 's/ *personality=\\fIP\\fB//' -e 's/\(\\fB\(read\|write\)\)\\-/\1/' -e 's/ *\\fBpersonality\\fP=\\fIP\\fP//' \
	    -e 's/ (M=0\.\.personality\( & 31\)\?)/ (one per joint)/' \
	    -e 's/ (M=0\.\.( personality >> 5 ) & 31)/ (temperatures= of them)/' \
	    -e 's/ (M=0\.\.( personality >> 10 ) & 31)/ (weights= of them)/' \
	    -e 's/\[file=\\fIN\\fB\]/file=\\fIPATH\\fB/' -e 's/\[axes=\\fIN\\fB\]/axes=\\fILETTERS\\fB/' \
	    -e 's/\[units=\\fIN\\fB\]/units=\\fIUNITS\\fB/' -e 's/\(default: \)\?\(\\fI\)\?NAN\b/\1\2not a number/' \
	    -e 's|^\.\\" This file was extracted from .* using|.\\" This file was extracted from $(COMPONENT).comp using|' $@

install: install-man
install-man: $(COMPONENT).9
	install -d $(DESTDIR)$(RTLIBDIR) $(DESTDIR)$(MANDIR)/man9
	install -m 644 $(COMPONENT).9 $(DESTDIR)$(MANDIR)/man9
clean:
	rm -rf page
	rm -f $(COMPONENT).c *.o *.tmp *.sym *.ver $(COMPONENT).so $(COMPONENT).9
.PHONY: install-man clean
