:- use_module(library(plunit)).
:- use_module(library(aggregate)).
:- use_module(library(lists)).
:- use_module(planner_golog(jobs)).
:- use_module(planner_golog(legs)).
:- use_module(planner_golog(greedy)).
:- use_module(planner_golog(runs)).
:- use_module(planner_golog(pools)).
:- use_module(planner_golog(prices)).
:- use_module(planner_golog(cover)).
:- use_module(planner_golog(travel), [travel/2]).

% Fleets as in a search for drinks: robots and things to look at stand on a floor of 10 by 10 m, anyhow but always the
% same; every third robot is half as fast, every fourth lacks what every second thing needs.

fleet(R, D, network(side(Nodes), Robots, R, Travel, [], true)) :-
    findall(X-Y, ( between(1, D, I), X is I * I * 37 mod 101, Y is I * 53 mod 97 ), Spots),
    findall(X-Y, ( between(1, R, I), X is I * 71 mod 103, Y is I * I * 29 mod 89 ), Docks),
    append(Spots, Docks, Points),
    findall(Place, ( nth1(I, Points, _), place(I, Place) ), Places),
    findall(Rows, ( member(Factor, [50, 100]), findall(Row, ( member(P, Points), row(Factor, P, Points, Row) ), Rows) ),
            Tables),
    findall(robot(Name, Profile, Row),
            ( nth1(I, Docks, P), name(I, Name), profile(I, Profile), Factor is 50 * Profile,
              row(Factor, P, Points, Row) ),
            Profiled),
    travel(tables(Places, Profiled, Tables), Travel),
    findall(robot(Name, here, none), ( between(1, R, I), name(I, Name) ), Robots),
    findall(Node, ( between(1, D, J), look_at(R, J, Node) ), Nodes).

name(I, Name) :- format(atom(Name), 'r~|~`0t~d~2+', [I]).
place(I, Place) :- atom_concat(p, I, Place).
profile(I, Profile) :- ( I mod 3 =:= 0 -> Profile = 2 ; Profile = 1 ).
row(Factor, X-Y, Points, Row) :- findall(T, ( member(A-B, Points), T is Factor * (abs(X - A) + abs(Y - B)) ), Row).

look_at(R, J, alt(J, [option(Names, held(J, Who, seq([Go, Look])))])) :-
    findall(Name, ( between(1, R, I), \+ ( I mod 4 =:= 0, J mod 2 =:= 0 ), name(I, Name) ), Names),
    atom_concat(?, J, Who),
    place(J, Place),
    Go = step(go(J), [Who], Place, 1.0, 0, [Place], []),
    Look = step(look(J), [Who], none, 1.0, 1000, [none], []).

crews(R, D, Jobs, Crews) :-
    fleet(R, D, Network),
    separable(Network, Jobs),
    Jobs = jobs(D, Crews, R, floor(0, [], []), []).

table(Crew, Horizon, Ways, Layers, Next) :-
    ways(Crew, Ways),
    run_table(Ways, Horizon, 1_000_000, Layers, Next).

%   All sets of jobs that some order does within the horizon, and the least time of each, by trying all orders.
tried(Crew, Horizon, Sorted) :-
    Crew = crew(_, _, _, _, _, _, Legs),
    findall(Set-Ms, ( orders(Legs, Order), length_of(Crew, Order, Ms), Ms =< Horizon, set_of(Order, Set) ), All),
    findall(Set-Least, aggregate(min(Ms), member(Set-Ms, All), Least), Pairs),
    sort(Pairs, Sorted).

orders(Legs, [Leg|Order]) :- select(Leg, Legs, Rest), ( Order = [] ; orders(Rest, Order) ).

set_of(Legs, Set) :- findall(Job, ( member(Leg, Legs), leg_job(Leg, Job) ), Jobs), jobs_mask(Jobs, Set).

listed(Layers, Sorted) :-
    append(Layers, Runs),
    findall(Set-Least, aggregate(min(Ms), At^Spare^Ks^member(run(Set, At, Spare, Ms, Ks), Runs), Least), Pairs),
    sort(Pairs, Sorted).

:- begin_tests(runs).

test('all sets in the least time, as trying all orders finds',
     [forall(member(Horizon, [5000, 9000, 14000, 90000]))]) :-
    crews(2, 5, _, [_, Crew]),
    table(Crew, Horizon, _, Layers, _),
    listed(Layers, Listed),
    tried(Crew, Horizon, Tried),
    Listed == Tried.
test('up to the next run the table is the same, from then on it is not') :-
    crews(2, 6, _, [Crew|_]),
    table(Crew, 9000, _, Layers, Next),
    Before is Next - 1,
    table(Crew, Before, _, Same, Next),
    table(Crew, Next, _, More, _),
    listed(Layers, Listed), listed(Same, Listed),
    length(Listed, Size), listed(More, Larger), length(Larger, Larger_size),
    Larger_size >= Size,
    More \== Layers.
test('a table too large is not made', fail) :-
    crews(2, 6, _, [Crew|_]),
    ways(Crew, Ways),
    run_table(Ways, 90000, 50, _, _).
test('of sets only those are left that are in no other', Sets == Maximal) :-
    crews(2, 6, _, [Crew|_]),
    table(Crew, 9000, Ways, Layers, _),
    run_sets(Ways, 9000, Layers, true, Sets0),
    sort(Sets0, Sets),
    listed(Layers, Listed),
    findall(Set, ( member(Set-_, Listed), \+ ( member(Other-_, Listed), Other =\= Set, Set /\ Other =:= Set ) ), Maximal).
test('a detour may be quicker: then all sets are left', [Monotone, Size] == [false, 2]) :-
    % Straight to b it takes 9, over c 1 + 1.
    travel(tables([b, c], [robot(r1, 1, [9, 1])], [[[0, 1], [1, 0]]]), Travel),
    findall(step(Place, [r1], Place, 1.0, 0, [Place], []), member(Place, [b, c]), Steps),
    separable(network(side(Steps), [robot(r1, here, none)], 1, Travel, [], true), jobs(2, [Crew], _, _, _)),
    table(Crew, 5, Ways, Layers, _),
    run_sets(Ways, 5, Layers, Monotone, Sets),
    length(Sets, Size).
test('the quickest run of a set', Ms == Least) :-
    crews(2, 5, _, [Crew|_]),
    tried(Crew, 90000, Tried),
    jobs_mask([1, 3, 4], Set), memberchk(Set-Least, Tried),
    ways(Crew, Ways),
    quickest_run(Ways, Set, 90000, Legs),
    length_of(Crew, Legs, Ms).
test('there may be none in time', fail) :-
    crews(2, 5, _, [Crew|_]),
    jobs_mask([1, 2, 3, 4, 5], Set),
    ways(Crew, Ways),
    quickest_run(Ways, Set, 9000, _).
test('what can be reached at all') :-
    crews(4, 6, _, Crews),
    nth1(4, Crews, Crew),
    ways(Crew, Ways),
    reachable(Ways, Set),
    jobs_mask([1, 3, 5], Set).

:- end_tests(runs).

%   Three robots; the first two can do 1 and 2 or 3, the last one can do 3 or 4.
pool(Jobs, Pool) :-
    jobs_mask(Jobs, Needed),
    findall(Robot,
            ( nth1(I, [[[1, 2], [3]], [[1, 2], [3]], [[3], [4]]], Lists),
              findall(Mask, ( member(List, Lists), jobs_mask(List, Mask) ), Masks),
              pool_robot(I, false, true, Needed, Masks, Robot) ),
            Pool).

chosen(Jobs, Seats, Chosen) :-
    pool(Jobs, Pool),
    prices(4, Prices),
    cover(Jobs, Pool, Seats, state(none, 0, 0, Prices, 0), Chosen0),
    sort(Chosen0, Chosen).

:- begin_tests(pools).

test('three robots do it all', Jobs == [1, 2, 3, 4]) :-
    chosen([1, 2, 3, 4], 3, Chosen),
    findall(Job, ( member(_-Mask, Chosen), between(1, 4, Job), Mask /\ (1 << Job) =\= 0 ), Jobs0),
    msort(Jobs0, Jobs).
test('two do not', fail) :- chosen([1, 2, 3, 4], 2, _).
test('two do less', Robots == [1, 3]) :- chosen([1, 2, 4], 2, Chosen), findall(I, member(I-_, Chosen), Robots).
test('with no seat nobody does anything', fail) :- chosen([1], 0, _).
test('what no one can do refutes it', Result == refuted) :-
    pool([1, 2, 5], Pool), prices(5, Prices),
    priced(100, Pool, [1, 2, 5], 3, Prices, _, Result).
test('prices refute two seats', Result == refuted) :-
    pool([1, 2, 3, 4], Pool), prices(4, Prices),
    priced(100, Pool, [1, 2, 3, 4], 2, Prices, _, Result).
test('what no plan can afford is struck off', Left == [4]) :-
    % 1 and 2 need one of the first two, 3 the other one: nobody is left for 4 but the last one.
    pool([1, 2, 3, 4], Pool0), prices(4, Prices0),
    priced(100, Pool0, [1, 2, 3, 4], 3, Prices0, Prices, Result), Result \== refuted,
    affordable(Pool0, [1, 2, 3, 4], 3, Prices, Pool),
    memberchk(p(3, _, _, _, Sets), Pool),
    ( Sets = [set(_, Left)] -> true ; memberchk(set(_, [4]), Sets), Left = [4] ).

:- end_tests(pools).

makespan(Jobs, Runs, Makespan) :- solution(Jobs, Runs, Makespan, _, _).

:- begin_tests(fleets).

test('the first plan is a plan, a better one is one too') :-
    crews(10, 20, Jobs, _),
    numlist(1, 20, All),
    greedy(Jobs, All, Runs0),
    improved(Jobs, 0, Runs0, Runs),
    makespan(Jobs, Runs0, First),
    makespan(Jobs, Runs, Least),
    append(Runs, Legs), findall(Job, ( member(Leg, Legs), leg_job(Leg, Job) ), Done),
    msort(Done, All),
    Least < First.
test('the optimum, as trying all partitions found',
     [forall(member(R-D-Least, [3-5-5750, 4-8-7000, 5-9-6550, 6-10-5550]))]) :-
    fleet(R, D, Network),
    best_cover(Network, 10_000_000, plan(optimal, Least, Least, _, _, _)).
test('10 robots and 20 things are proven') :-
    fleet(10, 20, Network),
    best_cover(Network, 3_000_000, plan(optimal, Makespan, Makespan, _, Steps, _)),
    length(Steps, 40).
test('20 robots and 50 things are proven; stopped early, there is a plan and a bound') :-
    fleet(20, 50, Network),
    best_cover(Network, 60_000_000, plan(optimal, Least, Least, _, Steps, _)),
    length(Steps, 100),
    best_cover(Network, 1_000_000, plan(satisficing, Makespan, Bound, _, _, _)),
    0 < Bound, Bound =< Least, Least =< Makespan.

:- end_tests(fleets).
