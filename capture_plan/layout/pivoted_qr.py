"""Pivoted QR in blocks: the place that answers most to what is not answered yet, one after another.

Data       X[n] (k r)   what place n answers to the k blendshapes, one column a coordinate, millimetres
Step       take the place with the largest |X[n]|^2 for each of its landmarks, then X -= U U^T X, U a basis of X[n]
When nothing is left, all start again with the places not taken. (Pivoted QR of Manohar et al. 2018 takes one row a
sensor; a landmark has three.)
"""

import numpy as np
from jaxtyping import Float, Int

NOTHING = 1e-9  # of the largest squared movement


class Pivots:
    """What is left of X while places are taken; X is (n r k), rows of the deltas."""

    def __init__(self, X: Float[np.ndarray, "n r k"]) -> None:
        """Nothing is taken yet."""
        self.shape = X.shape
        self.whole = np.ascontiguousarray(X.reshape(-1, X.shape[2]).T)
        self.nothing = NOTHING * np.square(X).sum(axis=(1, 2)).max(initial=0)
        self.left = self.whole.copy()

    def take(self, subset: Int[np.ndarray, " m"], size: Int[np.ndarray, " n"]) -> int:
        """The best of the places `subset`, which is projected out; `size` are the landmarks of every place."""
        n, r, _ = self.shape
        gain = np.square(self.left).sum(axis=0).reshape(n, r).sum(axis=1)
        if gain[subset].max() <= self.nothing:
            self.left = self.whole.copy()
            gain = np.square(self.left).sum(axis=0).reshape(n, r).sum(axis=1)
        best = int(subset[(gain / size)[subset].argmax()])
        U, sigma, _ = np.linalg.svd(self.left[:, best * r : best * r + r], full_matrices=False)
        U = U[:, sigma**2 > self.nothing]
        self.left -= U @ (U.T @ self.left)
        return best
