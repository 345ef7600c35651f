//! End-to-end tests of trueaxis; the tests are the files beside this folder.
