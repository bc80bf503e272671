# SPDX-License-Identifier: MIT
"""What all results of a stage have in common: a page, a file, a table."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from symkin import present
from symkin.errors import ResultsError, SymkinError, known_extension, printable
from symkin.present import Page
from symkin.storage.output_files import OutputFiles
from symkin.storage.records import decoded, encoded
from symkin.storage.results_file import read_results, write_results
from symkin.values import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

_VERSION = 1  # of the fields of results, and of what they hold


class Result(Value):
    """A result of a stage, which a person may look at, print, save and publish."""

    def page(self) -> Page:
        """Return what there is to say of it, from which text and HTML are rendered."""
        return present.page_of(self)

    def summary(self) -> Page:
        """Return the top of its page, without what takes longer to calculate."""
        return present.summary_of(self)

    def text(self, *, whole: bool = False, folder: str = "", files: Sequence[str] = ()) -> str:
        """Return what the command line prints of it.

        Parameters
        ----------
        whole : bool
            Whether to add all sections of the page, as ``--verbose`` does.
        folder : str
            Where its files are, for the command that it proposes.
        files : sequence of str
            What was written there, which takes lines of the screen.
        """
        told = self.page() if whole else self.summary()
        page = dataclasses.replace(told, files=files)
        return present.page_text(page, whole=whole, folder=folder)

    def __repr__(self) -> str:
        """Return title, verdict and the few numbers that matter."""
        return f"{type(self).__name__}: {present.summary_text(self.summary())}"

    def _repr_html_(self) -> str:
        """Show the summary in a notebook."""
        return present.notebook_of(self)

    def report(
        self, path: str | os.PathLike[str], *, overwrite: bool = False, all_figures: bool = False
    ) -> Path:
        """Write its page: one HTML file that needs no other.

        Parameters
        ----------
        path : str or path
            The file; its folder is made if it does not exist.
        overwrite : bool
            Whether a file that exists may be replaced.
        all_figures : bool
            Whether to draw figures for details too, which the page of a good result leaves out.

        Returns
        -------
        Path
            The file.
        """
        with present.with_figures(all_figures):
            return present.write_page(self.page(), Path(path), overwrite=overwrite)

    def plot(self, name: str = "") -> FigureBase | Axes:
        """Draw a figure of its page, by default the first.

        Parameters
        ----------
        name : str
            Which, such as ``"residuals"`` of an estimate.

        Raises
        ------
        SymkinError
            For another name, naming those that there are.
        """
        figures = present.figures_of(self.page())
        if not figures:
            raise SymkinError(f"a {type(self).__name__} has no figures")
        chosen = name or next(iter(figures))
        if chosen not in figures:
            names = ", ".join(figures)
            raise SymkinError(f'no figure is called "{name}"; expected one of {names}')
        return figures[chosen]()

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write it as a JSON file: what it says, and what it is, see `document`.

        Parameters
        ----------
        path : str or path
            The file, whose name ends in ``.json``.
        overwrite : bool
            Whether a file that exists may be replaced.

        Returns
        -------
        Path
            The file.
        """
        known_extension(Path(path), ".json")
        write_results(self.document(), path, overwrite=overwrite)
        return Path(path)

    def document(self, told: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return what its file has: what is `told` of it, by default `to_dict`, and it itself.

        The last, ``"result"``, says its kind, and has all its fields to the last bit:
        `symkin.read_result` makes an equal result of them.
        """
        itself = {"kind": type(self).__name__, "version": _VERSION, "fields": encoded(self)}
        return {**(self.to_dict() if told is None else told), "result": itself}

    def columns(self) -> Mapping[str, Any]:
        """Return it as the columns of a table, names with units."""
        raise NotImplementedError

    def to_frame(self) -> Any:
        """Return it as a `pandas.DataFrame`, columns as in symkin's files.

        Raises
        ------
        ImportError
            If pandas, which symkin does not need otherwise, is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError("to_frame needs pandas: pip install pandas") from error
        return pd.DataFrame(dict(self.columns()))


class FolderResult(Result):
    """A result that is a folder of files.

    Attributes
    ----------
    FILES : tuple of str
        Their names; the last is the report.
    SOMETIMES : tuple of str
        Names of others, which are there only where there is something to say.
    """

    FILES: ClassVar[tuple[str, ...]] = ("results.json", "report.html")
    SOMETIMES: ClassVar[tuple[str, ...]] = ()

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that there are to write."""
        return self.FILES

    def write(
        self, folder: str | os.PathLike[str], *, overwrite: bool = False, report: bool = True
    ) -> Path:
        """Write its files, see `FILES`.

        Parameters
        ----------
        folder : str or path
            Made if it does not exist.
        overwrite : bool
            Whether files that exist may be replaced, and those of an earlier result removed.
        report : bool
            Whether to draw the report, which takes as long as all else.

        Returns
        -------
        Path
            The report, or the results without it.
        """
        files = self.files if report else self.files[:-1]
        with OutputFiles(overwrite=overwrite) as outputs:
            target = outputs.folder(Path(folder), *self.SOMETIMES, *self.FILES)
            self.write_files(target, report=report)
        return Path(folder) / files[-1]

    def write_files(self, folder: Path, *, report: bool = True) -> None:
        """Write them into a folder that is there."""
        self.save(folder / "results.json")
        if report:
            self.write_report(folder)

    def write_report(self, folder: Path) -> None:
        """Draw the report into a folder that has the other files."""
        page = dataclasses.replace(self.page(), files=self.files[:-1])
        present.write_page(page, folder / "report.html")


def loaded(
    path: str | os.PathLike[str],
    kinds: Collection[type[Result]],
    classes: Mapping[type, type] | None = None,
) -> Any:
    """Read a result of some kinds from its JSON file, or from the folder that it was written to.

    Of `classes` others are made instead. Raises `ResultsError` if the file cannot be read, or has
    no result, or one of another kind or version.
    """
    file = _results_file(Path(path))
    document = read_results(file)
    result = document.get("result")
    if "result" not in document and isinstance(document.get("estimate"), dict):  # as it was before
        fields = dict(document["estimate"])
        result = {"kind": "Estimate", "version": fields.pop("version", None), "fields": fields}
    if not isinstance(result, dict) or result.keys() != {"kind", "version", "fields"}:
        raise ResultsError(
            f"{file}: has no result that loads back, as files of older symkins, and tables; run "
            "the command again that wrote it"
        )
    if result["version"] != _VERSION:
        raise ResultsError(
            f"{file}: has a result of version {printable(str(result['version']))}; expected "
            f"{_VERSION}: run the command again that wrote it with this version of symkin, or "
            "update symkin"
        )
    by_name = {kind.__name__: kind for kind in kinds}
    name = printable(str(result["kind"]))
    if name not in by_name:
        raise ResultsError(
            f'{file}: has a result of kind "{name}"; expected {" or ".join(sorted(by_name))}'
        )
    try:
        return decoded(by_name[name], result["fields"], classes)
    except ResultsError as error:
        raise ResultsError(
            f"{file}: {error}; run the command again that wrote it with this version of symkin"
        ) from error


def _results_file(path: Path) -> Path:
    """The file itself, or the one of a folder that has results."""
    if not path.is_dir():
        return path
    files = sorted(path.glob("*.json"))
    named = path / "results.json"
    if named in files or not files:
        return named
    if len(files) > 1:
        names = ", ".join(each.name for each in files)
        raise ResultsError(f"{path}: has several results; expected one of its files {names}")
    return files[0]
