"""Reference meridians and their finite-element spaces; scikit-fem stays behind this wall."""
