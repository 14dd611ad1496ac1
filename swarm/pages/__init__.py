"""Reports: pages of HTML about a run or a sweep."""
