"""Work on items in order, the next ones begun ahead in other threads."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")


class Ahead(Generic[Item]):
    """Iterates over ``(item, future of function(item))``; at most ``depth`` are begun ahead of the one given out.

    So memory holds a few of them, however long the items take.  Without a pool each is done when its turn comes.
    """

    def __init__(
        self, pool: Executor | None, function: Callable[[Item], Any], items: Iterable[Item], depth: int
    ) -> None:
        self._pool, self._function, self._items, self._depth = pool, function, items, depth
        self._begun: deque[tuple[Item, Future[Any]]] = deque()

    def __iter__(self) -> Iterator[tuple[Item, Future[Any]]]:
        for item in self._items:
            self._begun.append((item, self._begin(item)))
            if self._pool is None or len(self._begun) > self._depth:
                yield self._begun.popleft()
        while self._begun:
            yield self._begun.popleft()

    def broken_off(self) -> Iterator[tuple[Item, Future[Any]]]:
        """Cancel what has not begun; what has, in order, when it is done."""
        begun = [(item, future) for item, future in self._begun if not future.cancel()]
        self._begun.clear()
        yield from begun

    def _begin(self, item: Item) -> Future[Any]:
        if self._pool is not None:
            return self._pool.submit(self._function, item)
        future: Future[Any] = Future()
        try:
            future.set_result(self._function(item))
        except Exception as error:
            future.set_exception(error)
        return future
