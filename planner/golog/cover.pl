:- module(planner_cover,
          [ best_cover/3                % +Network, +Limit, -Result
          ]).

/** <module> The least makespan of what robots do on their own: one run for each so that all jobs are done

Within a horizon every robot has a table of runs (planner_runs). A plan that ends by then is a choice of
one run a robot that does all jobs (a cover). The least horizon for which there is one is found by
bisection, between what is refuted and the best plan known; that there is none is shown by depth-first
search: a job is given to a robot, or it is not, and prices (planner_prices) tell what cannot work out.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(planner_golog(jobs)).
:- use_module(planner_golog(legs), [never/1]).
:- use_module(planner_golog(greedy)).
:- use_module(planner_golog(runs)).
:- use_module(planner_golog(pools)).
:- use_module(planner_golog(prices)).

:- set_prolog_flag(optimise, true).

%   So many runs, of all robots together, fit into memory.
max_runs(1_000_000).

%   What the first try at a horizon may take, in inferences; each round tries harder.
patience(2_000_000).

%!  best_cover(+Network, +Limit:integer, -Result) is det.
%
%   Result is one of
%     - plan(Status, Makespan, Bound, Choices, Steps, Nodes): Status is optimal or satisficing; no plan ends before
%       Bound; Choices are Id-Label; Steps are step(Start, End, Id, Robots) by start, then id
%     - none(proven, Nodes): there is no plan
%     - none(unknown, Nodes): none was found within about Limit inferences
%     - not_separable
%
%   Times are milliseconds. A plan is called optimal only if the network is exact too.

best_cover(Network, Limit, Result) :-
    (   separable(Network, Jobs)
    ->  statistics(inferences, Start),
        End is Start + Limit,
        Jobs = jobs(N, _, _, _, _),
        prices(N, Prices),
        never(Never),
        State = state(none, 0, 0, Prices, Never),
        first_plan(Jobs, State),
        ( ( Limit =< 0 ; closed(State) ) -> true ; search(Jobs, End, State) ),
        result(State, Network, Jobs, Result)
    ;   Result = not_separable
    ).

%   State is changed in place: state(Plan, Bound, Nodes, Prices, Ceiling). Plan is plan(Makespan, Runs) or none; Prices
%   are the last ones; for horizons from Ceiling on, tables are too large.

result(state(Plan, Bound, Nodes, _, _), Network, Jobs, Result) :-
    never(Never),
    (   Plan = plan(_, Runs)
    ->  solution(Jobs, Runs, Makespan, Choices, Steps),
        (   Bound >= Makespan, Network = network(_, _, _, _, _, true)
        ->  Status = optimal
        ;   Status = satisficing
        ),
        Least is min(Bound, Makespan),
        Result = plan(Status, Makespan, Least, Choices, Steps, Nodes)
    ;   Bound >= Never
    ->  Result = none(proven, Nodes)
    ;   Result = none(unknown, Nodes)
    ).

first_plan(Jobs, State) :-
    Jobs = jobs(_, _, _, floor(Floor, _, _), _),
    nb_setarg(2, State, Floor),
    needed(Jobs, none, Needed),
    ( greedy(Jobs, Needed, Runs) -> planned(Jobs, Runs, State) ; true ).

%   The jobs that no one else than a robot does within the horizon (none: ever).
needed(jobs(N, _, _, _, Free), Horizon, Needed) :-
    findall(Job, ( between(1, N, Job), \+ ( memberchk(Job-floor(Ms, _, _), Free), in_time(Ms, Horizon) ) ), Needed).

in_time(Ms, Horizon) :- ( Horizon == none -> true ; Ms =< Horizon ).

planned(Jobs, Runs, State) :-
    solution(Jobs, Runs, Makespan, _, _),
    upper(State, Best),
    ( Makespan < Best -> nb_setarg(1, State, plan(Makespan, Runs)) ; true ).

shortened(Jobs, State) :-
    State = state(Plan, Bound, _, _, _),
    (   Plan = plan(_, Runs0)
    ->  improved(Jobs, Bound, Runs0, Runs),
        planned(Jobs, Runs, State)
    ;   true
    ).

upper(state(Plan, _, _, _, _), Upper) :-
    ( Plan = plan(Upper, _) -> true ; never(Upper) ).

% ----------------------------------------------------------------------------------------- bisection

search(Jobs, End, State) :-
    Jobs = jobs(_, Crews, _, _, _),
    shortened(Jobs, State),
    maplist(ways, Crews, Ways),
    patience(Patience),
    (   State = state(none, _, _, _, _),
        call_with_inference_limit(hopeless(Jobs, Ways, State), Patience, Result),
        Result \== inference_limit_exceeded
    ->  never(Never),
        nb_setarg(2, State, Never)
    ;   rounds(Patience, Jobs, Ways, End, State)
    ).

%   However long it takes, they cannot do it all: each robot all that it ever gets to, yet not in a team as large as
%   that.
hopeless(Jobs, Ways, State) :-
    needed(Jobs, none, Needed),
    jobs_mask(Needed, Mask),
    Jobs = jobs(_, Crews, _, _, _),
    once_pool(Crews, 1, Ways, Mask, Pool),
    seats(Jobs, Seats),
    \+ cover(Needed, Pool, Seats, State, _).

once_pool([], _, [], _, []).
once_pool([Crew|Crews], I, [Ways|More], Mask, [Robot|Pool]) :-
    Crew = crew(_, Begun, _, _, _, _, _),
    reachable(Ways, Reachable),
    pool_robot(I, Begun, true, Mask, [Reachable], Robot),
    I1 is I + 1,
    once_pool(Crews, I1, More, Mask, Pool).

seats(jobs(_, Crews, Team, _, _), Seats) :-
    include(begun, Crews, Begun),
    length(Begun, Taken),
    Seats is max(0, Team - Taken).

begun(crew(_, true, _, _, _, _, _)).

%   Each round goes up from the bound towards the best plan; what it cannot decide within its patience is left to the
%   next round.
rounds(Patience, Jobs, Ways, End, State) :-
    State = state(_, Low, _, _, _),
    bisect(Low, Patience, Jobs, Ways, End, State),
    statistics(inferences, Now),
    State = state(_, Bound, _, _, Ceiling),
    (   ( closed(State) ; Bound >= Ceiling ; Now >= End )
    ->  true
    ;   Patience1 is 4 * Patience,
        rounds(Patience1, Jobs, Ways, End, State)
    ).

closed(State) :-
    State = state(_, Bound, _, _, _),
    upper(State, Upper),
    Bound >= Upper.

bisect(Low, Patience, Jobs, Ways, End, State) :-
    State = state(_, Bound, _, _, Ceiling),
    upper(State, Upper),
    High is min(Upper, Ceiling),
    statistics(inferences, Now),
    Left is End - Now,
    (   ( Low >= High ; Left =< 0 ; Low > Bound, 4 * (High - Low) =< 3 * (High - Bound) )
    ->  true
    ;   horizon(Low, High, Horizon),
        Allowed is min(Patience, Left),
        decided(Allowed, Horizon, Jobs, Ways, State, Answer),
        followed(Answer, Low, Horizon, Jobs, State, Low1),
        bisect(Low1, Patience, Jobs, Ways, End, State)
    ).

followed(found(Runs), Low, _, Jobs, State, Low) :-
    planned(Jobs, Runs, State),
    shortened(Jobs, State).
followed(refuted(Next), _, _, _, State, Next) :-
    nb_setarg(2, State, Next).
followed(too_large, Low, Horizon, _, State, Low) :-
    nb_setarg(5, State, Horizon).
followed(unknown, _, Horizon, _, _, Low) :-
    Low is Horizon + 1.

%   Nearer to the bound, where tables are smaller; twice as far where there is no plan yet.
horizon(Low, High, Horizon) :-
    Horizon is min((3 * Low + High) // 4, 2 * Low + 1000).

%   Answer: found(Runs); refuted(Next): no plan ends before Next; too_large: there are too many runs; or unknown.
decided(Allowed, Horizon, Jobs, Ways, State, Answer) :-
    catch(call_with_inference_limit(decide(Horizon, Jobs, Ways, State, Answer0), Allowed, Result),
          error(resource_error(_), _), Answer0-Result = too_large-memory),
    ( Result == inference_limit_exceeded -> Answer = unknown ; Answer = Answer0 ).

decide(Horizon, Jobs, Ways, State, Answer) :-
    needed(Jobs, Horizon, Needed),
    jobs_mask(Needed, Mask),
    Jobs = jobs(_, Crews, _, _, Free),
    max_runs(Max),
    (   pool(Crews, 1, Ways, Horizon, Mask, Max, Pool, Next0)
    ->  foldl(sooner(Horizon), Free, Next0, Next),
        seats(Jobs, Seats),
        (   cover(Needed, Pool, Seats, State, Chosen)
        ->  runs(Ways, 1, Horizon, Chosen, Runs),
            Answer = found(Runs)
        ;   Answer = refuted(Next)
        )
    ;   Answer = too_large
    ).

%   When a job can next be done without a robot.
sooner(Horizon, _-floor(Ms, _, _), Next0, Next) :-
    ( Ms > Horizon -> Next is min(Next0, Ms) ; Next = Next0 ).

%   Fails if there are more than Max runs. Next: when the first run that is not among them ends.
pool([], _, _, _, _, _, [], Never) :- never(Never).
pool([Crew|Crews], I, [Ways|More], Horizon, Mask, Max, [Robot|Pool], Next) :-
    Crew = crew(_, Begun, _, _, _, _, _),
    run_table(Ways, Horizon, Max, Layers, Next1),
    maplist(length, Layers, Lengths),
    sum_list(Lengths, Many),
    run_sets(Ways, Horizon, Layers, Monotone, Sets),
    pool_robot(I, Begun, Monotone, Mask, Sets, Robot),
    I1 is I + 1,
    Left is Max - Many,
    pool(Crews, I1, More, Horizon, Mask, Left, Pool, Next2),
    Next is min(Next1, Next2).

runs([], _, _, _, []).
runs([Ways|More], I, Horizon, Chosen, [Legs|Runs]) :-
    ( memberchk(I-Set, Chosen) -> true ; Set = 0 ),
    quickest_run(Ways, Set, Horizon, Legs),
    I1 is I + 1,
    runs(More, I1, Horizon, Chosen, Runs).
