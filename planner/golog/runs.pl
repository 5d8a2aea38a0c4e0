:- module(planner_runs,
          [ ways/2,                     % +Crew, -Ways
            reachable/2,                % +Ways, -Set
            run_table/5,                % +Ways, +Horizon, +MaxRuns, -Layers, -Next
            run_sets/5,                 % +Ways, +Horizon, +Layers, -Monotone, -Sets
            quickest_run/4              % +Ways, +Set, +Horizon, -Legs
          ]).

/** <module> All runs of one robot within a horizon

A run is a sequence of jobs. Of runs that do the same jobs, end at the same place and need as much of the
battery, the quickest is enough (dynamic programming over sets; Held, Karp 1962). The table is filled
layer by layer: layer K holds the runs of K jobs. A set of jobs is a bit mask: job J is the bit 1 << J.
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(ordsets)).
:- use_module(library(apply)).
:- use_module(planner_golog(legs)).

:- set_prolog_flag(optimise, true).

%!  ways(+Crew, -Ways) is det.
%
%   What a robot can do, made ready: ways(Ms, Work, Rows, Legs). Runs begin at Ms and need at most Work of the
%   battery. Rows holds for each place (1: where runs begin; the others: where legs end) the legs from there by
%   time, n(Ms, Bit, End, Spare, K): the Kth of Legs does the job Bit, has Spare milliseconds of computations in
%   it, and ends at End (0: where it began).

ways(crew(_, _, Start, Ms, Work0, Tables, Legs), ways(Ms, Work, Rows, Array)) :-
    ( Work0 == none -> never(Work) ; Work = Work0 ),
    maplist(end_of, Legs, Ends),
    sort(Ends, Distinct),
    exclude(==(same), Distinct, Places),
    findall(Place-Number, ( nth1(I, Places, Place), Number is I + 1 ), Pairs),
    list_to_assoc([same-0|Pairs], Numbers),
    maplist(successors(Tables, Numbers, Legs), [Start|Places], Lists),
    compound_name_arguments(Rows, rows, Lists),
    compound_name_arguments(Array, legs, Legs).

end_of(Leg, End) :- leg_end(Leg, same, End).

successors(Tables, Numbers, Legs, At, Sorted) :-
    row(Tables, At, Row),
    successors(Legs, 1, Row, Numbers, All),
    sort(1, @=<, All, Sorted).

successors([], _, _, _, []).
successors([Leg|Legs], K, Row, Numbers, All) :-
    K1 is K + 1,
    (   leg_cost(Leg, Row, Ms)
    ->  leg_job(Leg, Job),
        leg_spare(Leg, Spare),
        leg_end(Leg, same, Place),
        get_assoc(Place, Numbers, End),
        Bit is 1 << Job,
        All = [n(Ms, Bit, End, Spare, K)|All1]
    ;   All = All1
    ),
    successors(Legs, K1, Row, Numbers, All1).

%!  reachable(+Ways, -Set) is det.
%
%   The jobs that the robot can ever do.

reachable(ways(_, _, Rows, _), Set) :-
    reach([1], [1], Rows, 0, Set).

reach([], _, _, Set, Set).
reach([At|Ats], Seen0, Rows, Set0, Set) :-
    arg(At, Rows, Row),
    bits(Row, Set0, Set1),
    findall(End, member(n(_, _, End, _, _), Row), Ends0),
    sort(Ends0, Ends1),
    ord_del_element(Ends1, 0, Ends),
    ord_union(Seen0, Ends, Seen, New),
    append(New, Ats, Ats1),
    reach(Ats1, Seen, Rows, Set1, Set).

bits([], Set, Set).
bits([n(_, Bit, _, _, _)|Row], Set0, Set) :-
    Set1 is Set0 \/ Bit,
    bits(Row, Set1, Set).

%!  run_table(+Ways, +Horizon, +MaxRuns, -Layers, -Next) is semidet.
%
%   Layers are lists of runs that end within the horizon: run(Set, At, Spare, Ms, Ks), Ks being the legs, the last
%   first; layer 0 is left out. Next is when the first of the other runs ends: with any horizon before that, the
%   table is the same. Fails if there are more runs than MaxRuns.

run_table(Ways, Horizon, MaxRuns, Layers, Next) :-
    Ways = ways(Ms, Work, Rows, _),
    (   Ms > Horizon
    ->  Layers = [], Next = Ms
    ;   never(Never),
        layers([run(0, 1, 0, Ms, [])], in(Rows, Horizon, Ms, Work), MaxRuns, Layers, Never, Next)
    ).

layers(Layer, In, Left, Layers, Next0, Next) :-
    extensions(Layer, In, Raw, [], Next0, Next1),
    sort(0, @=<, Raw, Sorted),
    quickest(Sorted, Runs),
    (   Runs == []
    ->  Layers = [], Next = Next1
    ;   length(Runs, More),
        Left1 is Left - More,
        Left1 >= 0,
        Layers = [Runs|Layers1],
        layers(Runs, In, Left1, Layers1, Next1, Next)
    ).

extensions([], _, Raw, Raw, Next, Next).
extensions([Run|Runs], In, Raw, Tail, Next0, Next) :-
    Run = run(_, At, _, _, _),
    In = in(Rows, _, _, _),
    arg(At, Rows, Row),
    extend(Row, Run, In, Raw, Raw1, Next0, Next1),
    extensions(Runs, In, Raw1, Tail, Next1, Next).

extend([], _, _, Raw, Raw, Next, Next).
extend([n(Cost, Bit, End, Idle, K)|Row], Run, In, Raw, Tail, Next0, Next) :-
    Run = run(Set, At, Spare, Ms, Ks),
    (   Set /\ Bit =\= 0
    ->  extend(Row, Run, In, Raw, Tail, Next0, Next)
    ;   Ms1 is Ms + Cost,
        In = in(_, Horizon, Start, Work),
        (   Ms1 > Horizon
        ->  Raw = Tail, Next is min(Next0, Ms1)
        ;   Spare1 is Spare + Idle,
            (   Ms1 - Start - Spare1 =< Work
            ->  Set1 is Set \/ Bit,
                ( End =:= 0 -> At1 = At ; At1 = End ),
                Raw = [run(Set1, At1, Spare1, Ms1, [K|Ks])|Raw1]
            ;   Raw = Raw1
            ),
            extend(Row, Run, In, Raw1, Tail, Next0, Next)
        )
    ).

%   Sorted by set, place, spare time, and time: the first of each is the quickest.
quickest([], []).
quickest([Run|Runs], [Run|Best]) :-
    Run = run(Set, At, Spare, _, _),
    slower(Runs, Set, At, Spare, Rest),
    quickest(Rest, Best).

slower([run(Set, At, Spare, _, _)|Runs], Set, At, Spare, Rest) :- !,
    slower(Runs, Set, At, Spare, Rest).
slower(Runs, _, _, _, Runs).

%!  run_sets(+Ways, +Horizon, +Layers, -Monotone, -Sets) is det.
%
%   What jobs the runs of a table do. If Monotone is true, a run without one of its jobs is a run; then Sets are
%   only those that no job can be added to.

run_sets(Ways, Horizon, Layers, Monotone, Sets) :-
    maplist(sets, Layers, Sets0),
    (   monotone(Ways, Horizon)
    ->  Monotone = true,
        maximal(Sets0, Sets1)
    ;   Monotone = false,
        Sets1 = Sets0
    ),
    append(Sets1, Sets).

sets(Runs, Sets) :-
    maplist(set_of, Runs, Sets0),
    sort(Sets0, Sets).

set_of(run(Set, _, _, _, _), Set).

maximal([], []).
maximal([Sets], [Sets]) :- !.
maximal([Sets, More|Rest], [Maximal|Others]) :-
    phrase(without_one(More), Parts0),
    sort(Parts0, Parts),
    ord_subtract(Sets, Parts, Maximal),
    maximal([More|Rest], Others).

without_one([]) --> [].
without_one([Set|Sets]) --> without_one(Set, Set), without_one(Sets).

without_one(Left, Set) -->
    (   { Left =:= 0 }
    ->  []
    ;   { Part is Set xor (Left /\ -Left), Left1 is Left /\ (Left - 1) },
        [Part],
        without_one(Left1, Set)
    ).

%   Leaving out a leg never makes what follows later, nor does it need more of the battery then: the triangle
%   inequality, as far as the horizon reaches.
monotone(ways(Ms, _, Rows, Legs), Horizon) :-
    \+ ( arg(_, Legs, Leg), leg_and_back(Leg) ),
    Left is Horizon - Ms,
    \+ ( arg(_, Rows, Row), detour(Row, Rows, Legs, Left) ).

detour(Row, Rows, Legs, Left) :-
    Row = [n(Least, _, _, _, _)|_],
    Least =< Left,
    functor(Legs, _, Size),
    functor(Direct, direct, Size),
    maplist(direct(Direct), Row),
    member(n(Ms1, Bit, End, Idle, _), Row),
    ( Ms1 > Left -> !, fail ; End > 0 ),
    arg(End, Rows, Then),
    Left1 is Left - Ms1,
    Spent is Ms1 - Idle,
    longer_without(Then, Bit, Left1, Spent, Direct), !.

direct(Direct, n(Ms, _, _, _, K)) :- arg(K, Direct, Ms).

longer_without([n(Ms, Bit1, _, _, K)|Row], Bit, Left, Spent, Direct) :-
    Ms =< Left,
    (   Bit1 =\= Bit,
        arg(K, Direct, Without),
        \+ ( integer(Without), Without =< Spent + Ms )
    ->  true
    ;   longer_without(Row, Bit, Left, Spent, Direct)
    ).

%!  quickest_run(+Ways, +Set, +Horizon, -Legs) is semidet.
%
%   The run that does exactly these jobs, as legs in order, and ends first; fails if none ends within the horizon.

quickest_run(ways(Ms, Work, Rows, Array), Set, Horizon, Legs) :-
    (   Set =:= 0
    ->  Legs = []
    ;   Rows =.. [_|Lists],
        maplist(only(Set), Lists, Lists1),
        Rows1 =.. [rows|Lists1],
        never(Never),
        run_table(ways(Ms, Work, Rows1, Array), Horizon, Never, Layers, _),
        last(Layers, Runs),
        findall(End-Ks, member(run(Set, _, _, End, Ks), Runs), Pairs),
        keysort(Pairs, [_-Reversed|_]),
        foldl(in_front(Array), Reversed, [], Legs)
    ).

in_front(Array, K, Legs, [Leg|Legs]) :- arg(K, Array, Leg).

only(Set, Row, Some) :- include(of(Set), Row, Some).

of(Set, n(_, Bit, _, _, _)) :- Set /\ Bit =\= 0.
