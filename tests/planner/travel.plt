:- use_module(library(plunit)).
:- use_module(planner_golog(travel)).

% Two robots that travel alike and one that is slower; nobody gets from p2 to p3.

tables(T) :-
    travel(tables([p1, p2, p3],
                  [robot(anna, 1, [5, 6, 7]), robot(bert, 1, [1, 2, -1]), robot(carl, 2, [9, 9, 9])],
                  [[[0, 10, 20], [10, 0, -1], [20, 30, 0]], [[0, 40, 50], [40, 0, -1], [50, 60, 0]]]), T).

:- begin_tests(travel).

test('from here each robot has its own times', Ms == [5, 1, 9]) :-
    tables(T), findall(M, ( member(R, [anna, bert, carl]), travel_time(T, R, here, p1, M) ), Ms).
test('between places robots that travel alike share a table', Ms == [20, 20, 50]) :-
    tables(T), findall(M, ( member(R, [anna, bert, carl]), travel_time(T, R, p1, p3, M) ), Ms).
test('rows are from, columns to', M == 30) :- tables(T), travel_time(T, anna, p3, p2, M).
test('to where it is takes no time', M == 0) :- tables(T), travel_time(T, carl, p2, p2, M).
test('where there is no way there is no time', fail) :- tables(T), travel_time(T, anna, p2, p3, _).
test('nor from here', fail) :- tables(T), travel_time(T, bert, here, p3, _).
test('nor to a place that is not in the tables', fail) :- tables(T), travel_time(T, anna, here, p4, _).
test('nor from one', fail) :- tables(T), travel_time(T, anna, p4, p1, _).
test('nor for a robot that does not travel', fail) :- tables(T), travel_time(T, dora, here, p1, _).
test('from anywhere: all ways there are', Ways == [here-7, p1-20, p3-0]) :-
    tables(T), findall(From-M, travel_time(T, anna, From, p3, M), Ways).
test('without tables nobody gets anywhere', fail) :- no_travel(T), travel_time(T, anna, here, p1, _).
test('places are numbered in order', Is == [1, 2, 3]) :- tables(T), findall(I, ( member(P, [p1, p2, p3]), place_index(T, P, I) ), Is).

:- end_tests(travel).
